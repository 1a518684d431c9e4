/* ARM: a private copy of the trajectory, checked slice by slice while the host is served. [main] */
#ifndef ARMING_H
#define ARMING_H

#include <stdbool.h>
#include <stdint.h>

#include "../registers.h"

/* Nothing is armed. */
void arming_init(void);

/* Begin to check the trajectory with this CRC; PENDING where that goes on. Without the lock. */
enum fd_result arming_begin(uint32_t crc);

/* Check a slice; PENDING until the last, then what became of ARM. Without the lock. */
enum fd_result arming_go_on(void);

/* A check goes on. */
bool arming_pending(void);

/* Samples that it has still to look at. */
uint32_t arming_samples_left(void);

/* With the lock: follow what is armed. */
void arming_start(void);

#endif
