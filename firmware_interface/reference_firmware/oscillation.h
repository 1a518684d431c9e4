/* Whether the feedback keeps an axis swinging to and fro. [sample]
 *
 * A swing is the way of the deviation (position - reference) from one turning point to the next;
 * what rest allows is none. Two swings are a cycle. The feedback feeds a cycle if, over it, the
 * effort less the feed-forward does positive work on the deviation: a passivity observer (Hannaford
 * and Ryu, Time-domain passivity control of haptic interfaces, IEEE Trans. Robotics and Automation
 * 18, 2002). A hand that pushes the axis, stick-slip, and whatever else the feedback damps put work
 * into it. Where the reference itself changes its speed more than the deviation does, it may ask for
 * such work. What swings faster than the encoder can show is seen by the effort alone: it alternates
 * from sample to sample.
 */
#ifndef OSCILLATION_H
#define OSCILLATION_H

#include <stdbool.h>

#include "drive.h"

/* At power-on: nothing has swung. */
void oscillation_reset(void);

/* Take in a sample; true where an axis is kept swinging. */
bool oscillation_seen(const struct drive_sample *sample);

#endif
