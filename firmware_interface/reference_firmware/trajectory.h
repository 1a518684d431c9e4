/* Reference motions, as firmware_interface/motion.py defines them: a table out of the registers,
 * and where it puts the axes, sample by sample. Time zero is the first captured sample; before it
 * a quintic envelope blends from the rest position into the motion. */
#ifndef TRAJECTORY_H
#define TRAJECTORY_H

#include <stdbool.h>
#include <stdint.h>

#include "controller.h"

#define MAXIMUM_COMPONENTS 8u
#define MAXIMUM_LEVELS 12u

/* One sine; its phase counts 2^-64 turns, so that it does not drift however long the motion. */
struct sine {
    float amplitude_rad;
    float rate_rad_s;
    uint64_t phase;
    uint64_t step; /* per sample */
};

/* Levels, each with the ramp to the next: where the motion is in them. */
struct staircase {
    float speed_rad_s[MAXIMUM_LEVELS + 1u]; /* the last is standstill */
    float dwell_s;
    float acceleration_rad_s2;
    uint16_t levels;
    uint16_t segment; /* even: at a level, odd: on the ramp after it */
    float start_rad; /* of the segment, from the rest position */
    float late_s; /* time into the segment at its first sample */
    uint32_t samples; /* since that one */
};

struct axis_motion {
    float rest_rad;
    uint16_t components;
    struct sine sines[MAXIMUM_COMPONENTS];
    struct staircase stairs;
};

struct trajectory {
    uint16_t kind;
    uint32_t lead_in_samples;
    uint32_t capture_samples;
    uint32_t sample; /* since the beginning of the lead-in */
    struct axis_motion axis[FD_AXES];
};

/* [main] CRC-32 of the table's words in the registers: by it the host says which one it means. */
uint32_t trajectory_crc(void);

/* [main] Take the table out of the registers; false where it is incomplete, not finite or faster
 * than the sampling. */
bool trajectory_read(struct trajectory *trajectory);

/* [main] Begin the lead-in where the axes rest. */
void trajectory_begin(struct trajectory *trajectory, const struct setpoint rest[FD_AXES]);

/* [both] The setpoints of the next sample. */
void trajectory_next(struct trajectory *trajectory, struct setpoint setpoints[FD_AXES]);

#endif
