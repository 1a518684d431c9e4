/* What differs from board to board. self_test.c says what is refused. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stdint.h>

#include "../registers.h"

#define SAMPLE_PERIOD_NS 2500000u
#define SAMPLE_PERIOD_S 0.0025f
#define TWO_PI 6.28318530718f
#define CARRY_LEFT 0.951229425f /* exp(-SAMPLE_PERIOD_S / 50 ms), of what bridges an exchange */

struct axis_settings {
    float travel_rad;
    float speed_rad_s;
    float acceleration_rad_s2; /* of a trajectory */
    float effort_nm; /* at most 32767 PWM counts */
    float following_error_rad;
    float gain_step;
    float effort_jump_nm; /* that other gains may bring; 0 on any axis: there is no COMMIT_RUNNING */
    float inertia, viscous_friction; /* of the drive, to check feedback; inertia 0: not checked */
    struct fd_gain_bank gain_maximum;
    struct fd_gain_bank first_gains; /* in force until others are stored */
};

struct board_settings {
    uint32_t serial_number;
    uint32_t control_delay_ns; /* measured: encoder latch to PWM update */
    uint32_t counts_per_turn;
    float effort_per_count_nm;
    uint32_t frame_gap_us; /* silence that ends a frame: 3.5 characters on a serial line */
    uint32_t turnaround_us; /* silence before a reply: the same; 0 where no line is shared */
    uint32_t confirm_window_us; /* less than half of the clock's round */
    struct axis_settings axis[FD_AXES];
};

#endif
