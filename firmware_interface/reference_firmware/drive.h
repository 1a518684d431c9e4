/* Encoders, PWM and controllers: what happens in one control sample. [sample] */
#ifndef DRIVE_H
#define DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "transfer.h"

/* One control sample in counts; following error is reference - position. */
struct drive_sample {
    int32_t position[FD_AXES];
    int32_t following_error[FD_AXES];
    int16_t effort[FD_AXES];
    float feedback[FD_AXES]; /* the effort less the feed-forward */
};

#define REST_COUNTS 2u /* the encoders of an axis at rest stray no farther */

/* [main] Before the first sample. */
void drive_init(void);

/* Exchange the gains of all axes between two samples; they are to be held where they stand. */
void drive_set_gains(const struct fd_gain_bank gains[FD_AXES]);

/* Take up control where the axes stand; until then no effort, and the brake applied. */
void drive_power_on(void);
void drive_power_off(void);
bool drive_powered(void);

/* Latch the encoders; or what they showed last. */
void drive_latch(struct drive_sample *sample);
void drive_latched(struct drive_sample *sample);

/* What these gains would make of the sample latched; or go on with them in it. */
void drive_consider(const struct fd_gain_bank gains[FD_AXES], const struct setpoint setpoints[FD_AXES],
                    const struct drive_sample *sample, bool moving, struct transfer *transfer);
void drive_take_over(const struct fd_gain_bank gains[FD_AXES], const struct transfer *transfer);

/* Command the efforts of the sample latched. False where an effort came out as no finite number:
 * then none is commanded. */
bool drive_take_sample(const struct setpoint setpoints[FD_AXES], struct drive_sample *sample);

/* What the law of an axis remembers of its reference. */
const struct law_memory *drive_memory(unsigned axis);

/* Position latched last. */
float drive_position_rad(unsigned axis);

/* Mean over the last 50 ms. */
float drive_speed_rad_s(unsigned axis);

/* The encoders stood still for the last 50 ms. */
bool drive_at_rest(void);

float drive_rad_per_count(void);

#endif
