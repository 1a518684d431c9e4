/* The whole firmware, as the port's start-up code, interrupt and main loop call it. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>

/* Once, before the sample interrupt is let in. */
void board_power_up(void);

/* [sample] Let one control period pass; the encoders are latched already. */
void board_sample(void);

/* [main] Serve the serial line; call it as often as possible, at least every millisecond. True
 * where more work waits: then call it again at once, without sleep. On a board that identifies by
 * itself a call lasts as long as that; meanwhile it serves the line. */
bool board_poll(void);

#endif
