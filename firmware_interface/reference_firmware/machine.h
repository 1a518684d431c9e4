/* The state machine: what a control sample does, and what commands may do to it. */
#ifndef MACHINE_H
#define MACHINE_H

#include <stdbool.h>
#include <stdint.h>

#include "../registers.h"
#include "trajectory.h"

struct machine {
    enum fd_state state;
    enum fd_fault fault; /* the first since CLEAR_FAULT; STO takes the place of WATCHDOG */
    uint32_t fault_sample;
    uint32_t samples; /* since power-up */
    bool roll_back_due; /* as soon as the axes stand */
    uint32_t until_capture; /* samples */
    uint32_t to_capture;
    uint32_t restless; /* samples since a stop's ramp ended, in which an axis has not come to rest */
};

/* Written by the sample interrupt; in the main loop, hold the lock. */
extern struct machine machine;

/* [main] Before the first sample; a self-test that failed is a fault which nothing clears. */
void machine_init(bool self_test_passed);

/* [sample] Let one control period pass. */
void machine_sample(void);

/* The rest: both, in the main loop with the lock. */

/* An axis moves or is about to. */
bool machine_moving(void);

/* A motion has begun and is not over. */
bool machine_in_motion(void);

/* Something goes on that nobody else may take over from the host that holds the board. */
bool machine_busy(void);

/* The wired emergency stop is pressed, or has been since the last CLEAR_FAULT. */
bool machine_sto(void);

/* Let the control law act where the axes stand; or switch the effort off. */
void machine_enable(void);
void machine_disable(void);

/* Whether gains may be exchanged while the law acts; else why not. */
enum fd_result machine_takes_gains(void);

/* Lead-in and captured motion. */
void machine_follow(const struct trajectory *trajectory);

/* Decelerate to rest; an axis that does not come to rest soon after the ramp loses its effort. */
void machine_stop(void);

/* Begin that where an axis moves, under effort, in a state that no motion ends. */
void machine_bring_to_rest(void);

/* Leave FAULT, without effort. */
void machine_clear_fault(void);

/* Put the previous gains back. A trajectory was checked with the others: it is armed no longer. */
enum fd_result machine_roll_back(void);

#endif
