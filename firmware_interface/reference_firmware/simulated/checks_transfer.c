/* Checks of gains that come into force while the control law acts. */
#include "checks.h"

#include <stdlib.h>
#include <string.h>

#include "../capture_ring.h"
#include "../commands.h"
#include "../gain_banks.h"
#include "../handover.h"
#include "../machine.h"
#include "../setpoints.h"
#include "client.h"
#include "simulation.h"

#define LOGGED 400u

/* Efforts of the samples from the command on, and which of them put other gains in force. */
static struct log {
    int16_t effort[LOGGED][FD_AXES];
    unsigned samples, exchanged_at;
    enum fd_result result;
} with, without;
static struct log *logging;

static void note_effort(void)
{
    if (logging->samples < LOGGED) {
        if (gain_banks_unconfirmed() && logging->exchanged_at == LOGGED) {
            logging->exchanged_at = logging->samples;
        }
        memcpy(logging->effort[logging->samples++], simulation.effort, sizeof simulation.effort);
    }
}

/* Into the stop after a motion, with gains staged that differ by these; gives their CRC. */
static uint32_t come_to_rest(float proportional, float offset_nm)
{
    struct fd_gain_bank gains[FD_AXES];
    simulation_reset();
    check_set_up();
    check_arm_sine(0.5f, 3.0f, 100u);
    memcpy(gains, gain_banks_active(), sizeof gains);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        gains[axis].proportional = proportional;
        gains[axis].derivative = 0.1f * proportional;
        gains[axis].viscous_feedforward = 0.8f;
        gains[axis].coulomb_feedforward = 1.2f;
        gains[axis].inertia_feedforward = 0.4f;
        gains[axis].offset_feedforward = offset_nm;
    }
    const uint32_t crc = client_stage(gains);
    CHECK(crc != 0 && client_command(FD_OPCODE_START, FD_MAP_CRC) == FD_RESULT_DONE);
    while (machine.state == FD_STATE_MOVING) {
        CHECK(client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY) == 0);
    }
    simulation_samples(20);
    return crc;
}

/* The same with a command of this opcode, so that both take the same time. */
static void play(struct log *log, enum fd_opcode opcode, float proportional, float offset_nm)
{
    const uint32_t crc = come_to_rest(proportional, offset_nm);
    memset(log, 0, sizeof *log);
    log->exchanged_at = LOGGED;
    logging = log;
    CHECK(setpoints_moving());
    simulation.on_effort = note_effort;
    log->result = client_command(opcode, crc);
    while (log->samples < LOGGED) {
        CHECK(client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY) == 0);
    }
    simulation.on_effort = NULL;
}

#define NO_COMMAND ((enum fd_opcode)200)

static void exchange_on_the_way_to_rest_does_not_step_the_effort(void)
{
    static const float proportional[] = {10.0f, 30.0f, 60.0f, 120.0f, 300.0f};
    for (unsigned n = 0; n < sizeof proportional / sizeof proportional[0]; n++) {
        play(&without, NO_COMMAND, proportional[n], 0.0f);
        play(&with, FD_OPCODE_COMMIT_RUNNING, proportional[n], 0.0f);
        CHECK(client_u16(FD_REG_STATUS_LAST_RESULT) == FD_RESULT_DONE);
        CHECK(without.exchanged_at == LOGGED && with.exchanged_at < 10u);
        for (unsigned axis = 0; axis < FD_AXES; axis++) { /* rounding alone tells them apart */
            const int difference = with.effort[with.exchanged_at][axis]
                - without.effort[with.exchanged_at][axis];
            CHECK(abs(difference) <= 1);
        }
        CHECK(machine.state == FD_STATE_DRAINING && !machine_moving());
        uint16_t all[2];
        client_put_u32(all, capture_ring_counters().pages_written);
        CHECK(client_write(FD_REG_CAPTURE_PAGES_ACKNOWLEDGED, all, 2u) == 0);
        simulation_samples(2);
        CHECK(client_command(FD_OPCODE_FINISH, 0) == FD_RESULT_DONE);
        CHECK(client_command(FD_OPCODE_CONFIRM, 0) == FD_RESULT_DONE);
    }
}

static void jump_beyond_its_limit_leaves_all_as_it_is(void)
{
    play(&without, NO_COMMAND, 60.0f, 2.9f);
    play(&with, FD_OPCODE_COMMIT_RUNNING, 10.0f, 2.9f);
    CHECK(client_u16(FD_REG_STATUS_LAST_RESULT) == FD_RESULT_EFFORT_JUMP);
    CHECK(memcmp(with.effort, without.effort, sizeof with.effort) == 0);
    CHECK(memcmp(gain_banks_active(), &simulation.settings.axis[0].first_gains,
                 sizeof(struct fd_gain_bank)) == 0);
    CHECK(client_u16(FD_REG_STATUS_UNCONFIRMED) == 0);
}

/* A command as if it had just come over the line, before any sample. */
static enum fd_result command_at_once(enum fd_opcode opcode, uint32_t argument)
{
    static uint16_t token = 40000u;
    const struct command command = {(uint16_t)opcode, ++token, argument, CLIENT_KEY};
    commands_execute(&command);
    return commands_last_result();
}

static void stops_and_the_next_command_come_first(void)
{
    const uint32_t crc = come_to_rest(60.0f, 0.0f);
    CHECK(command_at_once(FD_OPCODE_COMMIT_RUNNING, crc) == FD_RESULT_PENDING);
    CHECK(command_at_once(FD_OPCODE_CONFIRM, 0) == FD_RESULT_WRONG_STATE);
    simulation_samples(1);
    CHECK(!gain_banks_unconfirmed());
    CHECK(command_at_once(FD_OPCODE_QUICK_STOP, 0) == FD_RESULT_DONE);
    CHECK(command_at_once(FD_OPCODE_COMMIT_RUNNING, crc) == FD_RESULT_WRONG_STATE);
    CHECK(come_to_rest(60.0f, 0.0f) == crc);
    CHECK(command_at_once(FD_OPCODE_COMMIT_RUNNING, crc) == FD_RESULT_PENDING);
    simulation_press_stop(true); /* in the very sample that would decide */
    simulation_samples(1);
    CHECK(commands_last_result() == FD_RESULT_WRONG_STATE);
    CHECK(!gain_banks_unconfirmed() && machine.fault == FD_FAULT_STO);
}

static void power_cut_at_any_step_leaves_the_old_gains_whole(void)
{
    for (unsigned step = 0; step < 3u; step++) {
        const uint32_t crc = come_to_rest(60.0f, 0.0f);
        if (step > 0) {
            CHECK(command_at_once(FD_OPCODE_COMMIT_RUNNING, crc) == FD_RESULT_PENDING);
        }
        if (step > 1u) {
            simulation_samples(1);
            CHECK(gain_banks_unconfirmed());
        }
        simulation_power_cycle();
        simulation_samples(200);
        CHECK(machine.state == FD_STATE_IDLE && !gain_banks_unconfirmed());
        CHECK(handover_result() == FD_RESULT_NONE);
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            CHECK(memcmp(&gain_banks_active()[axis], &simulation.settings.axis[axis].first_gains,
                         sizeof(struct fd_gain_bank)) == 0);
        }
    }
}

static void board_without_a_limit_does_not_know_the_command(void)
{
    simulation.settings.axis[1].effort_jump_nm = 0.0f;
    check_set_up();
    CHECK(client_u16(FD_REG_BUMPLESS_CAPABLE) == 0);
    const uint32_t crc = client_stage(gain_banks_active());
    CHECK(client_command(FD_OPCODE_COMMIT_RUNNING, crc) == FD_RESULT_UNKNOWN_COMMAND);
    CHECK(client_command(FD_OPCODE_COMMIT, crc) == FD_RESULT_DONE);
}

const struct check transfer_checks[] = {
    {"exchange_on_the_way_to_rest_does_not_step_the_effort",
     exchange_on_the_way_to_rest_does_not_step_the_effort},
    {"jump_beyond_its_limit_leaves_all_as_it_is", jump_beyond_its_limit_leaves_all_as_it_is},
    {"stops_and_the_next_command_come_first",
     stops_and_the_next_command_come_first},
    {"power_cut_at_any_step_leaves_the_old_gains_whole",
     power_cut_at_any_step_leaves_the_old_gains_whole},
    {"board_without_a_limit_does_not_know_the_command",
     board_without_a_limit_does_not_know_the_command},
};
const unsigned transfer_check_count = sizeof transfer_checks / sizeof transfer_checks[0];
