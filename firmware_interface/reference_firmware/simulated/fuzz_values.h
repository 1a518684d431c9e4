/* Where the fuzzer's choices come from, and the numbers that it likes. */
#ifndef FUZZ_VALUES_H
#define FUZZ_VALUES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "client.h"

/* The choices that follow are made from these bytes, as few as possible for each, so that another
 * byte is another choice. When there are none left, each choice is the first. */
void fuzz_choose_from(const uint8_t *bytes, size_t length);
bool fuzz_exhausted(void);

uint32_t fuzz_random(void);
uint32_t fuzz_below(uint32_t limit);

/* Once in so many times. */
bool fuzz_rarely(uint32_t times);

/* Evenly between. */
float fuzz_between(float lowest, float highest);

/* Any number that a float may be, of those that break laws: tiny, huge, none. */
float fuzz_hostile(void);

/* A motion that a host might ask for, with a hostile number here and there. */
void fuzz_table(uint16_t table[TABLE_WORDS]);

/* Change the gains of an axis to others that a host might stage, the same. */
void fuzz_gains(struct fd_gain_bank *gains, const struct fd_gain_bank *maxima);

#endif
