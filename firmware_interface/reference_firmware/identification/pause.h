/* What the network calls again and again while it computes: see NETWORK_PAUSE in its header. */
#ifndef PAUSE_H
#define PAUSE_H

void identification_pause(void);

#endif
