/* Gains in permanent memory. Two slots are written in turn, so that a power cut at any moment of
 * a write leaves the gains of the write before. [main], without the lock: memory is slow. */
#ifndef GAIN_STORE_H
#define GAIN_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "../registers.h"

/* The gains stored last, be it by firmware of map 3; false where there are none that this firmware may use. */
bool gain_store_load(struct fd_gain_bank gains[FD_AXES]);

/* Write them, unless they are what was stored last: memory wears out. False where they do not read
 * back. */
bool gain_store_save(const struct fd_gain_bank gains[FD_AXES]);

/* Times that memory was written, over the board's life. */
uint32_t gain_store_writes(void);

#endif
