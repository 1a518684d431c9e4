/* The whole firmware, as the port's start-up code, interrupt and main loop call it. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

#include "register_file.h"

/* Once, before the sample interrupt is let in. */
void board_power_up(void);

/* [sample] Let one control period pass; the encoders are latched already. */
void board_sample(void);

/* [main] Serve the serial line; call it as often as possible, at least every millisecond. */
void board_poll(void);

/* ---- for the protocol; without the lock */

/* A valid frame arrived: the host is alive. */
void board_frame_seen(void);

/* Words of consecutive registers, all of one moment; commands among them are carried out. */
enum access board_read(uint16_t address, uint16_t count, uint16_t *words);
enum access board_write(uint16_t address, uint16_t count, const uint16_t *words);

#endif
