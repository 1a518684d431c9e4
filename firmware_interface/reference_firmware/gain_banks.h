/* Active, shadow and previous gains: old or new, never a mixture.
 * In the main loop, hold the lock for all but gain_banks_check_staged. */
#ifndef GAIN_BANKS_H
#define GAIN_BANKS_H

#include <stdbool.h>
#include <stdint.h>

#include "../registers.h"

/* Before the first sample: put gains in force. */
void gain_banks_init(const struct fd_gain_bank gains[FD_AXES]);

/* In force. */
const struct fd_gain_bank *gain_banks_active(void);

/* Find out whether the shadow bank matches its CRC; after every write of the host. */
void gain_banks_check_staged(void);
bool gain_banks_staged_crc_ok(void);

/* A commit waits for its confirmation, for so long. */
bool gain_banks_unconfirmed(void);
uint32_t gain_banks_remaining_us(void);

/* Gains that ask for no effort: every term off. */
const struct fd_gain_bank *gain_banks_off(void);

/* Each number finite, inside its maximum and of a sign that it may have. */
bool gain_banks_within_maxima(const struct fd_gain_bank gains[FD_AXES]);

/* Take the shadow bank, if it may be committed and is the one with this CRC. */
enum fd_result gain_banks_staged(uint32_t crc, struct fd_gain_bank staged[FD_AXES]);

/* Put in force what was staged; keep it; or return to before. */
void gain_banks_commit(const struct fd_gain_bank staged[FD_AXES]);
enum fd_result gain_banks_confirm(void);
enum fd_result gain_banks_roll_back(void);

#endif
