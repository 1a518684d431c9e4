#include "commands.h"

#include <string.h>

#include "drive.h"
#include "gain_banks.h"
#include "gain_store.h"
#include "machine.h"
#include "port.h"
#include "setpoints.h"

#define TOKENS_REMEMBERED 64u

static uint16_t tokens[TOKENS_REMEMBERED];
static uint32_t tokens_seen;
static enum fd_result last_result;
static struct trajectory armed;

uint16_t commands_last_token(void)
{
    return tokens_seen ? tokens[(tokens_seen - 1u) % TOKENS_REMEMBERED] : 0;
}

enum fd_result commands_last_result(void)
{
    return last_result;
}

static bool remembered(uint16_t token)
{
    const uint32_t count = tokens_seen < TOKENS_REMEMBERED ? tokens_seen : TOKENS_REMEMBERED;
    for (uint32_t n = 0; n < count; n++) {
        if (tokens[n] == token) {
            return true;
        }
    }
    return false;
}

/* ---- those that take their time: the lock is held for their ends only */

/* Whether a command that needs the axes at rest in IDLE may go on. */
static enum fd_result idle_at_rest(void)
{
    port_lock();
    const enum fd_result result = machine.state != FD_STATE_IDLE ? FD_RESULT_WRONG_STATE
        : machine_moving() ? FD_RESULT_NOT_AT_REST : FD_RESULT_DONE;
    port_unlock();
    return result;
}

static enum fd_result arm(void)
{
    enum fd_result result = idle_at_rest();
    if (result != FD_RESULT_DONE) {
        return result;
    }
    if (!trajectory_read(&armed)) {
        return FD_RESULT_BAD_TRAJECTORY;
    }
    port_lock();
    trajectory_begin(&armed, setpoints_current());
    port_unlock();
    if (!trajectory_within_limits(&armed)) {
        return FD_RESULT_TRAJECTORY_LIMITS;
    }
    port_lock();
    /* a fault may have come meanwhile */
    result = machine.state == FD_STATE_IDLE ? FD_RESULT_DONE : FD_RESULT_WRONG_STATE;
    if (result == FD_RESULT_DONE) {
        machine.state = FD_STATE_ARMED;
    }
    port_unlock();
    return result;
}

static enum fd_result store(uint32_t argument)
{
    struct fd_gain_bank gains[FD_AXES];
    enum fd_result result = idle_at_rest();
    if (result != FD_RESULT_DONE) {
        return result;
    }
    if (argument != FD_STORE_SIGNATURE) {
        return FD_RESULT_WRONG_ARGUMENT;
    }
    port_lock();
    result = gain_banks_unconfirmed() ? FD_RESULT_UNCONFIRMED : FD_RESULT_DONE;
    memcpy(gains, gain_banks_active(), sizeof gains);
    port_unlock();
    if (result == FD_RESULT_DONE && !gain_store_save(gains)) {
        result = FD_RESULT_STORE_FAILED;
    }
    return result;
}

/* ---- those that take effect at once, between two samples */

static enum fd_result start(uint32_t argument)
{
    if (machine.state != FD_STATE_ARMED) {
        return FD_RESULT_WRONG_STATE;
    }
    if (argument != FD_MAP_CRC) {
        return FD_RESULT_WRONG_ARGUMENT;
    }
    machine_follow(&armed);
    return FD_RESULT_DONE;
}

static enum fd_result quick_stop(void)
{
    machine.roll_back_due = gain_banks_unconfirmed();
    if (machine.roll_back_due && !machine_moving()) {
        machine_roll_back();
    }
    if (machine.state == FD_STATE_ARMED || machine.state == FD_STATE_DONE) {
        machine.state = FD_STATE_IDLE;
    } else if (machine.state == FD_STATE_MOVING || machine.state == FD_STATE_DRAINING) {
        machine_stop();
    }
    return FD_RESULT_DONE;
}

static enum fd_result finish(void)
{
    if (machine.state != FD_STATE_DONE) {
        return FD_RESULT_WRONG_STATE;
    }
    machine.state = FD_STATE_IDLE;
    return FD_RESULT_DONE;
}

static enum fd_result clear_fault(void)
{
    if (machine.state != FD_STATE_FAULT) {
        return FD_RESULT_WRONG_STATE;
    }
    if (port_sto_active()) {
        return FD_RESULT_STO_ACTIVE;
    }
    if (machine_moving()) {
        return FD_RESULT_NOT_AT_REST;
    }
    machine.fault = FD_FAULT_NONE;
    machine.fault_sample = 0;
    setpoints_hold_here();
    drive_power_on();
    machine.state = FD_STATE_IDLE;
    return FD_RESULT_DONE;
}

static enum fd_result gain_command(uint16_t opcode)
{
    if (machine.state != FD_STATE_IDLE) {
        return FD_RESULT_WRONG_STATE;
    }
    if (machine_moving()) {
        return FD_RESULT_NOT_AT_REST;
    }
    if (opcode == FD_OPCODE_CONFIRM) {
        return gain_banks_confirm();
    }
    if (opcode == FD_OPCODE_ROLL_BACK) {
        return machine_roll_back();
    }
    const enum fd_result result = gain_banks_commit();
    if (result == FD_RESULT_DONE) {
        machine_exchange_gains();
    }
    return result;
}

static enum fd_result execute_at_once(uint16_t opcode, uint32_t argument)
{
    switch (opcode) {
    case FD_OPCODE_START:
        return start(argument);
    case FD_OPCODE_QUICK_STOP:
        return quick_stop();
    case FD_OPCODE_FINISH:
        return finish();
    case FD_OPCODE_CLEAR_FAULT:
        return clear_fault();
    case FD_OPCODE_COMMIT:
    case FD_OPCODE_CONFIRM:
    case FD_OPCODE_ROLL_BACK:
        return gain_command(opcode);
    default:
        return FD_RESULT_UNKNOWN_COMMAND;
    }
}

void commands_execute(uint16_t opcode, uint16_t token, uint32_t argument)
{
    if (remembered(token)) {
        return;
    }
    tokens[tokens_seen++ % TOKENS_REMEMBERED] = token;
    if (opcode == FD_OPCODE_ARM) {
        last_result = arm();
    } else if (opcode == FD_OPCODE_STORE) {
        last_result = store(argument);
    } else {
        port_lock();
        last_result = execute_at_once(opcode, argument);
        port_unlock();
    }
}
