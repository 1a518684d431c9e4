#include "machine.h"

#include <math.h>
#include <string.h>

#include "capture_ring.h"
#include "drive.h"
#include "gain_banks.h"
#include "port.h"
#include "register_file.h"
#include "setpoints.h"

struct machine machine;

void machine_init(void)
{
    memset(&machine, 0, sizeof machine);
    machine.last_frame_us = port_time_us();
    drive_init();
    drive_set_gains(gain_banks_active());
}

bool machine_moving(void)
{
    return setpoints_moving() || !drive_at_rest();
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
}

void machine_exchange_gains(void)
{
    drive_set_gains(gain_banks_active());
    /* friction holds a resting axis off its setpoint; stiffer gains would pull it there at once */
    setpoints_hold_here();
}

enum fd_result machine_roll_back(void)
{
    const enum fd_result result = gain_banks_roll_back();
    machine.roll_back_due = false;
    machine_exchange_gains();
    return result;
}

/* ---- protection */

/* The first fault stays until it is cleared. */
static void latch(enum fd_fault fault)
{
    machine.roll_back_due = gain_banks_unconfirmed();
    if (machine.fault == FD_FAULT_NONE) {
        machine.fault = fault;
        machine.fault_sample = machine.samples;
    }
}

static void coast(void)
{
    drive_power_off();
    setpoints_hold_here();
    machine.state = FD_STATE_FAULT;
}

static void check_watchdog(void)
{
    const uint32_t timeout_us = 1000u * register_u16(FD_REG_WATCHDOG_TIMEOUT);
    if (!setpoints_moving() || machine.fault != FD_FAULT_NONE
        || port_time_us() - machine.last_frame_us <= timeout_us) {
        return;
    }
    latch(FD_FAULT_WATCHDOG);
    if (register_u16(FD_REG_WATCHDOG_ACTION) == FD_WATCHDOGACTION_COAST) {
        coast();
    } else {
        machine_stop();
    }
}

static enum fd_fault violation(unsigned axis, const struct drive_sample *measured)
{
    const struct axis_settings *limit = &port_settings()->axis[axis];
    const float error_rad = (float)measured->following_error[axis] * drive_rad_per_count();
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
    enum fd_fault fault = port_sto_active() ? FD_FAULT_STO : FD_FAULT_NONE;
    for (unsigned axis = 0; axis < FD_AXES && fault == FD_FAULT_NONE; axis++) {
        fault = violation(axis, measured);
    }
    if (fault != FD_FAULT_NONE) {
        latch(fault);
        coast();
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
    if (capture_ring_samples() == machine.to_capture) {
        capture_ring_flush();
        setpoints_stop();
        machine.state = FD_STATE_DRAINING;
    }
}

/* Self-test: what can be seen without moving. */
static void leave_init(void)
{
    setpoints_hold_here();
    if (port_sto_active()) {
        latch(FD_FAULT_STO);
    }
    if (machine.fault == FD_FAULT_NONE) {
        drive_power_on();
        machine.state = FD_STATE_IDLE;
    } else {
        machine.state = FD_STATE_FAULT;
    }
}

/* Leave states whose end has come. */
static void follow_up(void)
{
    if (machine.state == FD_STATE_INIT) {
        leave_init();
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

void machine_sample(void)
{
    struct drive_sample measured;
    machine.samples++;
    check_watchdog();
    drive_take_sample(setpoints_advance(), &measured);
    if (drive_powered()) {
        check_limits(&measured);
    }
    if (machine.state == FD_STATE_MOVING) {
        capture(&measured);
    }
    follow_up();
    if (gain_banks_unconfirmed() && gain_banks_remaining_us() == 0) {
        machine.roll_back_due = true;
    }
    if (machine.roll_back_due && !machine_moving()) {
        machine_roll_back();
    }
}
