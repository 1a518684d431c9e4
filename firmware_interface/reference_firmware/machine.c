#include "machine.h"

#include <math.h>
#include <string.h>

#include "capture_ring.h"
#include "drive.h"
#include "gain_banks.h"
#include "handover.h"
#include "identification.h"
#include "oscillation.h"
#include "port.h"
#include "register_file.h"
#include "session.h"
#include "setpoints.h"

#define REST_SAMPLES_AFTER_RAMP 800u /* 2 s: soft feedback brings a heavy axis to rest in less */

struct machine machine;

void machine_init(bool self_test_passed)
{
    memset(&machine, 0, sizeof machine);
    machine.fault = self_test_passed ? FD_FAULT_NONE : FD_FAULT_SELF_TEST;
    port_sto_rearm(); /* what the latch holds from before is no pulse that anybody missed */
    drive_init();
    drive_set_gains(gain_banks_active());
    setpoints_init();
    handover_init();
}

bool machine_moving(void)
{
    return setpoints_moving() || !drive_at_rest();
}

bool machine_in_motion(void)
{
    return setpoints_moving() || machine.state == FD_STATE_MOVING
        || machine.state == FD_STATE_DRAINING || machine.state == FD_STATE_STOPPING;
}

bool machine_busy(void)
{
    return machine_in_motion() || machine.state == FD_STATE_CHECKING || !drive_at_rest();
}

bool machine_sto(void)
{
    return port_sto_active() || port_sto_latched();
}

enum fd_result machine_takes_gains(void)
{
    const bool takes = machine.state == FD_STATE_IDLE || machine.state == FD_STATE_DRAINING
        || machine.state == FD_STATE_DONE;
    if (!takes || machine.fault != FD_FAULT_NONE || machine.roll_back_due || machine_sto()) {
        return FD_RESULT_WRONG_STATE;
    }
    return drive_powered() ? FD_RESULT_DONE : FD_RESULT_NOT_ENABLED;
}

void machine_enable(void)
{
    setpoints_hold_here();
    oscillation_reset();
    drive_power_on();
}

void machine_disable(void)
{
    drive_power_off();
    setpoints_hold_here();
}

void machine_follow(const struct trajectory *trajectory)
{
    capture_ring_clear();
    machine.until_capture = trajectory->lead_in_samples;
    machine.to_capture = trajectory->capture_samples;
    setpoints_follow(trajectory);
    machine.state = FD_STATE_MOVING;
}

void machine_stop(void)
{
    setpoints_stop();
    machine.state = FD_STATE_STOPPING;
    machine.restless = 0;
}

void machine_bring_to_rest(void)
{
    if (drive_powered() && machine_moving() && machine.state != FD_STATE_DRAINING
        && machine.state != FD_STATE_STOPPING) {
        machine_stop();
    }
}

void machine_clear_fault(void)
{
    port_sto_rearm();
    machine.fault = FD_FAULT_NONE;
    machine.fault_sample = 0;
    machine.state = FD_STATE_IDLE;
}

enum fd_result machine_roll_back(void)
{
    const enum fd_result result = gain_banks_roll_back();
    machine.roll_back_due = false;
    drive_set_gains(gain_banks_active());
    /* friction holds a resting axis off its setpoint; stiffer gains would pull it there at once */
    setpoints_hold_here();
    if (machine.state == FD_STATE_ARMED || machine.state == FD_STATE_CHECKING) {
        machine.state = FD_STATE_IDLE;
    }
    return result;
}

/* ---- protection */

/* The first fault stays until it is cleared, but WATCHDOG gives way to the emergency stop: a host
 * clears WATCHDOG by itself, and the emergency stop only for a person. */
static void latch(enum fd_fault fault)
{
    machine.roll_back_due = gain_banks_unconfirmed();
    if (machine.fault == FD_FAULT_NONE
        || (fault == FD_FAULT_STO && machine.fault == FD_FAULT_WATCHDOG)) {
        machine.fault = fault;
        machine.fault_sample = machine.samples;
    }
}

static void coast(void)
{
    machine_disable();
    machine.state = FD_STATE_FAULT;
}

static void fail(enum fd_fault fault)
{
    latch(fault);
    coast();
}

/* A motion ends when its last page is fetched: until then a host owes the board a sign of life.
 * Nobody holds the board in a motion that another host stops: that one needs no guard. */
static bool sign_of_life_owed(void)
{
    return (setpoints_moving() || machine.state == FD_STATE_DRAINING)
        && machine.fault == FD_FAULT_NONE && session_key() != 0;
}

static void check_watchdog(void)
{
    const uint32_t timeout_us = 1000u * register_u16(FD_REG_WATCHDOG_TIMEOUT);
    if (!sign_of_life_owed() || session_silence_us() <= timeout_us) {
        return;
    }
    if (register_u16(FD_REG_WATCHDOG_ACTION) == FD_WATCHDOGACTION_COAST) {
        fail(FD_FAULT_WATCHDOG);
    } else {
        latch(FD_FAULT_WATCHDOG);
        machine_stop();
    }
}

/* Whether the setpoint moves on towards a limit switch that is pressed; away is the way out. */
static bool onto_switch(unsigned axis)
{
    const float velocity = setpoints_current()[axis].velocity_rad_s;
    const unsigned pressed = (unsigned)port_limit_switches() >> 2u * axis;
    return (velocity < 0.0f && (pressed & 1u)) || (velocity > 0.0f && (pressed & 2u));
}

static enum fd_fault violation(unsigned axis, const struct drive_sample *measured)
{
    const struct axis_settings *limit = &port_settings()->axis[axis];
    const float error_rad = (float)measured->following_error[axis] * drive_rad_per_count();
    if (onto_switch(axis)) {
        return FD_FAULT_LIMIT_SWITCH;
    }
    if (fabsf(drive_position_rad(axis)) > limit->travel_rad) {
        return FD_FAULT_TRAVEL;
    }
    if (fabsf(error_rad) > limit->following_error_rad) {
        return FD_FAULT_FOLLOWING_ERROR;
    }
    if (fabsf(drive_speed_rad_s(axis)) > limit->speed_rad_s) {
        return FD_FAULT_SPEED;
    }
    return FD_FAULT_NONE;
}

static void check_limits(const struct drive_sample *measured)
{
    enum fd_fault fault = machine_sto() ? FD_FAULT_STO : FD_FAULT_NONE;
    for (unsigned axis = 0; axis < FD_AXES && fault == FD_FAULT_NONE && drive_powered(); axis++) {
        fault = violation(axis, measured);
    }
    if (drive_powered() && oscillation_seen(measured) && fault == FD_FAULT_NONE) {
        fault = FD_FAULT_OSCILLATION;
    }
    if (fault != FD_FAULT_NONE) {
        fail(fault);
    }
}

/* A stop ends, and so does the wait for a rest in which gains can go back: what still moves some time
 * after the ramp loses the effort. */
static void check_stop(void)
{
    const bool stops = machine.state == FD_STATE_STOPPING || machine.state == FD_STATE_DRAINING
        || (machine.roll_back_due && machine.state != FD_STATE_MOVING);
    machine.restless = stops && drive_powered() && !setpoints_moving() && !drive_at_rest()
        ? machine.restless + 1u : 0;
    if (machine.restless > REST_SAMPLES_AFTER_RAMP) {
        fail(FD_FAULT_STOP_OVERDUE);
    }
}

/* Unconfirmed gains go once the axes stand, or have no effort. */
static void check_roll_back(void)
{
    if (gain_banks_unconfirmed() && gain_banks_remaining_us() == 0) {
        machine.roll_back_due = true;
    }
    if (machine.roll_back_due && (!machine_moving() || !drive_powered())) {
        machine_roll_back();
    }
}

/* ---- a sample */

static void capture(const struct drive_sample *measured)
{
    if (machine.until_capture > 0) {
        machine.until_capture--;
        return;
    }
    capture_ring_add(measured);
    identification_add(measured);
    if (capture_ring_counters().samples == machine.to_capture) {
        capture_ring_flush();
        identification_captured();
        setpoints_stop();
        machine.state = FD_STATE_DRAINING;
    }
}

/* Leave states whose end has come. */
static void follow_up(void)
{
    if (machine.state == FD_STATE_INIT) {
        /* without effort: nobody has asked for any */
        machine.state = machine.fault == FD_FAULT_NONE ? FD_STATE_IDLE : FD_STATE_FAULT;
    } else if (machine.state == FD_STATE_DRAINING && !machine_moving() && capture_ring_drained()) {
        machine.state = FD_STATE_DONE;
    } else if (machine.state == FD_STATE_STOPPING && !machine_moving()) {
        if (machine.fault == FD_FAULT_NONE) {
            machine.state = FD_STATE_IDLE;
        } else {
            coast(); /* a stop after a fault ends without effort */
        }
    }
}

/* Setpoints, encoders, efforts, and what they must not be. */
static void control(struct drive_sample *measured)
{
    setpoints_advance();
    if (!setpoints_finite()) {
        fail(FD_FAULT_NOT_FINITE);
    }
    drive_latch(measured);
    handover_decide(measured, machine_takes_gains(),
                    machine.state == FD_STATE_DRAINING && machine_moving());
    if (!drive_take_sample(setpoints_current(), measured)) {
        fail(FD_FAULT_NOT_FINITE);
    }
    check_limits(measured);
    if (!drive_powered()) {
        setpoints_hold_here(); /* so that nothing pulls when the effort comes back */
    }
}

void machine_sample(void)
{
    struct drive_sample measured;
    machine.samples++;
    check_watchdog();
    control(&measured);
    if (machine.state == FD_STATE_MOVING) {
        capture(&measured);
    } else {
        identification_idle();
    }
    check_stop();
    follow_up();
    session_sample(sign_of_life_owed() || machine.state == FD_STATE_CHECKING);
    check_roll_back();
}
