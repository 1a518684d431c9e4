#include "commands.h"

#include <string.h>

#include "arming.h"
#include "drive.h"
#include "feedback.h"
#include "gain_banks.h"
#include "gain_store.h"
#include "handover.h"
#include "identification.h"
#include "machine.h"
#include "port.h"
#include "session.h"

#define TOKENS_REMEMBERED 64u

static uint16_t tokens[TOKENS_REMEMBERED];
static uint32_t tokens_seen;
static enum fd_result last_result;
static bool awaits_sample; /* the last command is decided by one */

void commands_init(void)
{
    tokens_seen = 0;
    awaits_sample = false;
    last_result = FD_RESULT_NONE;
    arming_init();
}

uint16_t commands_last_token(void)
{
    return tokens_seen ? tokens[(tokens_seen - 1u) % TOKENS_REMEMBERED] : 0;
}

enum fd_result commands_last_result(void)
{
    return awaits_sample && last_result == FD_RESULT_PENDING ? handover_result() : last_result;
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

/* ---- motion; with the lock */

static enum fd_result start(uint32_t argument)
{
    if (machine.state != FD_STATE_ARMED) {
        return machine.state == FD_STATE_IDLE && !drive_powered() ? FD_RESULT_NOT_ENABLED
                                                                  : FD_RESULT_WRONG_STATE;
    }
    if (argument != FD_MAP_CRC) {
        return FD_RESULT_WRONG_ARGUMENT;
    }
    arming_start();
    identification_begin(commands_last_token(), machine.to_capture);
    return FD_RESULT_DONE;
}

static enum fd_result quick_stop(void)
{
    machine.roll_back_due = gain_banks_unconfirmed();
    if (machine.roll_back_due && !machine_moving()) {
        machine_roll_back();
    }
    if (machine.state == FD_STATE_CHECKING || machine.state == FD_STATE_ARMED
        || machine.state == FD_STATE_DONE) {
        machine.state = FD_STATE_IDLE;
    } else if (machine.state == FD_STATE_DRAINING) {
        machine_stop();
    }
    machine_bring_to_rest();
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

/* ---- effort; with the lock */

static enum fd_result clear_fault(void)
{
    if (machine.state != FD_STATE_FAULT || machine.fault == FD_FAULT_SELF_TEST) {
        return FD_RESULT_WRONG_STATE;
    }
    if (port_sto_active()) {
        return FD_RESULT_STO_ACTIVE;
    }
    if (machine_moving()) {
        return FD_RESULT_NOT_AT_REST;
    }
    machine_clear_fault();
    return FD_RESULT_DONE;
}

static enum fd_result enable(void)
{
    if (machine.state != FD_STATE_IDLE) {
        return FD_RESULT_WRONG_STATE;
    }
    if (drive_powered()) {
        return FD_RESULT_DONE;
    }
    if (machine_sto()) {
        return FD_RESULT_STO_ACTIVE;
    }
    if (machine_moving()) {
        return FD_RESULT_NOT_AT_REST;
    }
    machine_enable();
    return FD_RESULT_DONE;
}

static enum fd_result disable(void)
{
    if (machine.state == FD_STATE_FAULT) {
        return FD_RESULT_DONE;
    }
    if (machine.state != FD_STATE_IDLE && machine.state != FD_STATE_ARMED
        && machine.state != FD_STATE_DONE && machine.state != FD_STATE_STOPPING) {
        return FD_RESULT_WRONG_STATE;
    }
    if (machine_moving()) {
        machine_bring_to_rest();
        return FD_RESULT_NOT_AT_REST;
    }
    machine_disable();
    if (machine.state == FD_STATE_ARMED) {
        machine.state = FD_STATE_IDLE;
    }
    return FD_RESULT_DONE;
}

/* ---- gains */

/* With the lock: whether a command that needs the axes at rest in IDLE may go on. */
static enum fd_result idle_at_rest(void)
{
    return machine.state != FD_STATE_IDLE ? FD_RESULT_WRONG_STATE
        : machine_moving() ? FD_RESULT_NOT_AT_REST : FD_RESULT_DONE;
}

/* The bank that the host means, where its feedback is stable. */
static enum fd_result staged_gains(uint32_t crc, struct fd_gain_bank staged[FD_AXES])
{
    const struct board_settings *settings = port_settings();
    const enum fd_result result = gain_banks_staged(crc, staged);
    for (unsigned axis = 0; axis < FD_AXES && result == FD_RESULT_DONE; axis++) {
        if (!feedback_stable(&staged[axis], &settings->axis[axis], settings->control_delay_ns)) {
            return FD_RESULT_UNSTABLE_FEEDBACK;
        }
    }
    return result;
}

/* With the lock. */
static enum fd_result roll_back(void)
{
    if (machine.state == FD_STATE_STOPPING) {
        return FD_RESULT_NOT_AT_REST;
    }
    const enum fd_result result = idle_at_rest();
    if (result == FD_RESULT_NOT_AT_REST) {
        machine_bring_to_rest();
    }
    return result == FD_RESULT_DONE ? machine_roll_back() : result;
}

/* With the lock. */
static enum fd_result commit(uint32_t argument)
{
    struct fd_gain_bank staged[FD_AXES];
    enum fd_result result = idle_at_rest();
    if (result == FD_RESULT_DONE) {
        result = staged_gains(argument, staged);
    }
    return result == FD_RESULT_DONE ? handover_at_rest(staged) : result;
}

/* With the lock. */
static enum fd_result confirm(void)
{
    const enum fd_result result = idle_at_rest();
    return result == FD_RESULT_DONE ? gain_banks_confirm() : result;
}

/* With the lock. */
static enum fd_result commit_running(uint32_t argument)
{
    struct fd_gain_bank staged[FD_AXES];
    if (!handover_capable()) {
        return FD_RESULT_UNKNOWN_COMMAND;
    }
    enum fd_result result = machine_takes_gains();
    if (result == FD_RESULT_DONE) {
        result = staged_gains(argument, staged);
    }
    if (result != FD_RESULT_DONE) {
        return result;
    }
    handover_offer(staged);
    return FD_RESULT_PENDING;
}

/* Without the lock, which is held for the beginning only: memory is slow. */
static enum fd_result store(uint32_t argument)
{
    struct fd_gain_bank gains[FD_AXES];
    port_lock();
    enum fd_result result = idle_at_rest();
    if (result == FD_RESULT_DONE && argument != FD_STORE_SIGNATURE) {
        result = FD_RESULT_WRONG_ARGUMENT;
    } else if (result == FD_RESULT_DONE && gain_banks_unconfirmed()) {
        result = FD_RESULT_UNCONFIRMED;
    }
    memcpy(gains, gain_banks_active(), sizeof gains);
    port_unlock();
    if (result == FD_RESULT_DONE && !gain_store_save(gains)) {
        result = FD_RESULT_STORE_FAILED;
    }
    return result;
}

/* ---- all of them */

/* With the lock. */
static enum fd_result execute_at_once(const struct command *command)
{
    switch (command->opcode) {
    case FD_OPCODE_START:
        return start(command->argument);
    case FD_OPCODE_QUICK_STOP:
        return quick_stop();
    case FD_OPCODE_FINISH:
        return finish();
    case FD_OPCODE_CLEAR_FAULT:
        return clear_fault();
    case FD_OPCODE_ENABLE:
        return enable();
    case FD_OPCODE_DISABLE:
        return disable();
    case FD_OPCODE_COMMIT:
        return commit(command->argument);
    case FD_OPCODE_CONFIRM:
        return confirm();
    case FD_OPCODE_ROLL_BACK:
        return roll_back();
    case FD_OPCODE_COMMIT_RUNNING:
        return commit_running(command->argument);
    default:
        return FD_RESULT_UNKNOWN_COMMAND;
    }
}

static enum fd_result execute(const struct command *command)
{
    port_lock();
    handover_withdraw(); /* what no sample has decided comes too late */
    port_unlock();
    if (command->opcode == FD_OPCODE_ARM) {
        return arming_begin(command->argument);
    }
    if (command->opcode == FD_OPCODE_STORE) {
        return store(command->argument);
    }
    port_lock();
    const enum fd_result result = execute_at_once(command);
    port_unlock();
    return result;
}

/* Whether the host that holds the board sent it: then that host is alive. A stop of another one
 * ends its hold. */
static bool from_holder(uint32_t key, bool stops)
{
    port_lock();
    const bool held = session_held_by(key);
    if (held) {
        session_claim(key);
    } else if (stops) {
        session_stop(key);
    }
    port_unlock();
    return held;
}

void commands_execute(const struct command *command)
{
    if (remembered(command->token)) {
        return; /* nor does a late copy tell that the host is alive */
    }
    tokens[tokens_seen++ % TOKENS_REMEMBERED] = command->token;
    /* whoever sees the need may stop the machine */
    const bool stops = command->opcode == FD_OPCODE_QUICK_STOP;
    if (from_holder(command->key, stops) || stops) {
        last_result = execute(command);
        awaits_sample = command->opcode == FD_OPCODE_COMMIT_RUNNING;
    } else {
        last_result = FD_RESULT_NOT_HELD;
    }
}

bool commands_go_on(void)
{
    if (!arming_pending()) {
        return false;
    }
    const enum fd_result result = arming_go_on();
    if (last_result == FD_RESULT_PENDING && !awaits_sample) { /* else another command was refused or stopped it */
        last_result = result;
    }
    return arming_pending();
}
