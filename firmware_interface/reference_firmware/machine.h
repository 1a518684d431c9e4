/* The state machine: what a control sample does, and what commands may do to it. */
#ifndef MACHINE_H
#define MACHINE_H

#include <stdbool.h>
#include <stdint.h>

#include "../registers.h"
#include "trajectory.h"

struct machine {
    enum fd_state state;
    enum fd_fault fault; /* the first since CLEAR_FAULT */
    uint32_t fault_sample;
    uint32_t samples; /* since power-up */
    bool roll_back_due; /* as soon as the axes stand */
    uint32_t until_capture; /* samples */
    uint32_t to_capture;
    uint32_t last_frame_us;
};

/* Written by the sample interrupt; in the main loop, hold the lock. */
extern struct machine machine;

/* [main] Before the first sample. */
void machine_init(void);

/* [sample] Let one control period pass. */
void machine_sample(void);

/* The rest: both, in the main loop with the lock. */

/* An axis moves or is about to. */
bool machine_moving(void);

/* Lead-in and captured motion. */
void machine_follow(const struct trajectory *trajectory);

/* Decelerate to rest. */
void machine_stop(void);

/* Put the active bank in force where the axes stand. */
void machine_exchange_gains(void);

/* Put the previous gains back. */
enum fd_result machine_roll_back(void);

#endif
