/* Other gains in force: at rest at once, or, while the law acts, offered by a command and decided in
 * the next sample. In the main loop, hold the lock. */
#ifndef HANDOVER_H
#define HANDOVER_H

#include <stdbool.h>

#include "drive.h"

/* At power-up: nothing is offered. */
void handover_init(void);

/* Put gains in force where the axes stand, or leave all as it is and say why. */
enum fd_result handover_at_rest(const struct fd_gain_bank gains[FD_AXES]);

/* The board takes gains while the law acts. */
bool handover_capable(void);

/* Have the next sample decide about these gains; or take back what none has decided yet. */
void handover_offer(const struct fd_gain_bank gains[FD_AXES]);
void handover_withdraw(void);

/* What became of the last offer, PENDING until a sample has decided; and its jump. */
enum fd_result handover_result(void);
float handover_jump_nm(unsigned axis);

/* [sample] Put the gains on offer in force in the sample latched, or leave all as it is: where the
 * machine does not take them, it says why. `moving` while the axes are on their way to rest. */
void handover_decide(const struct drive_sample *sample, enum fd_result taken, bool moving);

#endif
