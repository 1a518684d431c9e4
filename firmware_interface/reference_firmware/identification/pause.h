/* What everything that computes calls again and again, the network too (NETWORK_PAUSE in its
 * header): at most 200 microseconds apart on a Cortex-M7 of 480 MHz. */
#ifndef PAUSE_H
#define PAUSE_H

void identification_pause(void);

#endif
