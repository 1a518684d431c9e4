/* Checks that every stop ends, whatever moves, and that gains which shake an axis do not last. */
#include "checks.h"

#include <math.h>
#include <string.h>

#include "../drive.h"
#include "../gain_banks.h"
#include "../machine.h"
#include "../session.h"
#include "client.h"
#include "simulation.h"

#define SAMPLES_A_SECOND 400u
#define BEAT_SAMPLES 80u
#define LONGEST_REST_S 2u /* after the ramp */

/* ---- a hand that pushes axis x to and fro */

static struct {
    double effort_nm, rate_rad_s, time_s;
} hand;

static void push(void)
{
    hand.time_s += SAMPLE_US * 1e-6;
    simulation.plants[0].offset = -hand.effort_nm * sin(hand.rate_rad_s * hand.time_s);
}

static void begin_to_push(double effort_nm, double frequency_hz)
{
    hand.effort_nm = effort_nm;
    hand.rate_rad_s = 6.283185307179586 * frequency_hz;
    hand.time_s = 0.0;
    simulation.on_effort = push; /* once a sample */
}

/* Time passes while a host gives signs of life. */
static void pass(unsigned samples)
{
    for (unsigned n = 0; n < samples; n++) {
        simulation_samples(1);
        if (n % BEAT_SAMPLES == 0) {
            CHECK(client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY) == 0);
        }
    }
}

static bool off(void)
{
    return !drive_powered() && !simulation.brake_released && simulation.effort[0] == 0
        && simulation.effort[1] == 0;
}

/* ---- gains */

/* Staged: feedback and offset of both axes; gives their CRC. */
static uint32_t stage(float proportional, float derivative, float integral, float offset_nm)
{
    struct fd_gain_bank gains[FD_AXES];
    memcpy(gains, gain_banks_active(), sizeof gains);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        gains[axis].proportional = proportional;
        gains[axis].derivative = derivative;
        gains[axis].integral = integral;
        gains[axis].velocity_filter = 0.0f;
        gains[axis].offset_feedforward = offset_nm;
    }
    const uint32_t crc = client_stage(gains);
    CHECK(crc != 0);
    return crc;
}

static bool old_gains_are_back(void)
{
    return !gain_banks_unconfirmed()
        && memcmp(gain_banks_active(), &simulation.settings.axis[0].first_gains,
                  sizeof(struct fd_gain_bank)) == 0;
}

/* Stiffer than at first, unconfirmed. */
static void commit_stiffer(void)
{
    CHECK(client_command(FD_OPCODE_COMMIT, stage(40.0f, 6.0f, 0.0f, 0.0f)) == FD_RESULT_DONE);
}

/* ---- checks */

static void a_loop_that_keeps_an_axis_swinging_is_ended(void)
{
    static const float banks[][3] = {{19.75f, 8.389f, 1130.2f}, {4.425f, 2.681f, 177.4f}};
    for (unsigned n = 0; n < sizeof banks / sizeof banks[0]; n++) {
        simulation_reset();
        simulation.settings.confirm_window_us = 60000000u;
        check_set_up();
        const uint32_t crc = stage(banks[n][0], banks[n][1], banks[n][2], 0.0f);
        CHECK(client_command(FD_OPCODE_COMMIT, crc) == FD_RESULT_DONE);
        simulation.plants[0].velocity_rad_s = 1.5; /* a knock */
        for (unsigned s = 0; s < 3u * SAMPLES_A_SECOND && machine.fault == FD_FAULT_NONE; s++) {
            pass(1u);
        }
        CHECK(machine.state == FD_STATE_FAULT && machine.fault == FD_FAULT_OSCILLATION);
        CHECK(off() && old_gains_are_back());
    }
}

static void a_coupling_that_breaks_in_a_motion_is_seen(void)
{
    check_set_up();
    const uint32_t crc = stage(160.0f, 16.0f, 0.0f, 0.0f); /* well damped as it is */
    CHECK(client_command(FD_OPCODE_COMMIT, crc) == FD_RESULT_DONE);
    CHECK(client_command(FD_OPCODE_CONFIRM, 0) == FD_RESULT_DONE);
    check_arm_sine(1.0f, 1.0f, 8000u);
    CHECK(client_command(FD_OPCODE_START, FD_MAP_CRC) == FD_RESULT_DONE);
    pass(3u * SAMPLES_A_SECOND);
    CHECK(machine.state == FD_STATE_MOVING);
    simulation.plants[0].inertia *= 0.02;
    simulation.plants[0].viscous_friction *= 0.02;
    simulation.plants[0].coulomb_friction *= 0.02;
    for (unsigned n = 0; n < SAMPLES_A_SECOND && machine.fault == FD_FAULT_NONE; n++) {
        pass(1u);
    }
    CHECK(machine.fault == FD_FAULT_OSCILLATION && off());
}

static void a_hand_that_pushes_is_no_oscillation(void)
{
    static const double frequencies_hz[] = {0.5, 1.0, 2.0, 4.0, 8.0};
    for (unsigned n = 0; n < sizeof frequencies_hz / sizeof frequencies_hz[0]; n++) {
        simulation_reset();
        check_set_up();
        begin_to_push(8.0, frequencies_hz[n]);
        pass(8u * SAMPLES_A_SECOND);
        CHECK(machine.state == FD_STATE_IDLE && machine.fault == FD_FAULT_NONE && drive_powered());
    }
}

static void a_stop_ends_whatever_moves(void)
{
    static const enum fd_opcode stops[] = {FD_OPCODE_QUICK_STOP, FD_OPCODE_DISABLE,
                                           FD_OPCODE_ROLL_BACK};
    for (unsigned n = 0; n < sizeof stops / sizeof stops[0]; n++) {
        simulation_reset();
        simulation.settings.confirm_window_us = 60000000u;
        check_set_up();
        commit_stiffer();
        begin_to_push(8.0, 2.0);
        pass(SAMPLES_A_SECOND / 2u);
        CHECK(machine.state == FD_STATE_IDLE && machine_moving());
        client_command(stops[n], 0);
        CHECK(machine.state == FD_STATE_STOPPING && drive_powered());
        pass(LONGEST_REST_S * SAMPLES_A_SECOND + 2u);
        CHECK(machine.state == FD_STATE_FAULT && machine.fault == FD_FAULT_STOP_OVERDUE && off());
        CHECK(old_gains_are_back());
    }
}

static void the_window_ends_whatever_moves(void)
{
    check_set_up(); /* the window lasts 2 s */
    commit_stiffer();
    begin_to_push(8.0, 2.0);
    pass(2u * SAMPLES_A_SECOND);
    pass(LONGEST_REST_S * SAMPLES_A_SECOND + 2u);
    CHECK(machine.fault == FD_FAULT_STOP_OVERDUE && off() && old_gains_are_back());
}

static void the_watchdog_ends_whatever_moves(void)
{
    check_set_up();
    check_arm_sine(1.0f, 1.0f, 8000u);
    CHECK(client_command(FD_OPCODE_START, FD_MAP_CRC) == FD_RESULT_DONE);
    pass(SAMPLES_A_SECOND);
    begin_to_push(8.0, 2.0);
    simulation_samples(SAMPLES_A_SECOND + 2u); /* silence */
    CHECK(machine.state == FD_STATE_STOPPING && machine.fault == FD_FAULT_WATCHDOG);
    simulation_samples(SAMPLES_A_SECOND / 2u + LONGEST_REST_S * SAMPLES_A_SECOND);
    CHECK(machine.state == FD_STATE_FAULT && machine.fault == FD_FAULT_WATCHDOG && off());
}

static void a_silent_host_loses_the_board_though_an_axis_moves(void)
{
    check_set_up();
    begin_to_push(8.0, 2.0);
    pass(SAMPLES_A_SECOND);
    CHECK(session_held_by(CLIENT_KEY) && machine_moving());
    simulation_samples((unsigned)(FD_SESSION_LEASE_S * (float)SAMPLES_A_SECOND) + 1u);
    CHECK(session_key() == 0 && machine_moving());
}

static void an_effort_that_would_jump_is_refused_at_rest(void)
{
    check_set_up();
    CHECK(client_command(FD_OPCODE_COMMIT, stage(30.0f, 4.0f, 0.0f, 2.5f))
          == FD_RESULT_EFFORT_JUMP);
    CHECK(old_gains_are_back());
    CHECK(client_command(FD_OPCODE_COMMIT, stage(30.0f, 4.0f, 0.0f, 2.3f)) == FD_RESULT_DONE);
}

static void feedback_that_is_unstable_as_stated_is_refused(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        simulation.settings.axis[axis].inertia = 0.4f;
        simulation.settings.axis[axis].viscous_friction = 0.8f;
    }
    check_set_up();
    CHECK(client_command(FD_OPCODE_COMMIT, stage(19.75f, 8.389f, 1130.2f, 0.0f))
          == FD_RESULT_UNSTABLE_FEEDBACK);
    CHECK(client_command(FD_OPCODE_COMMIT_RUNNING, stage(4.425f, 2.681f, 177.4f, 0.0f))
          == FD_RESULT_UNSTABLE_FEEDBACK);
    CHECK(old_gains_are_back());
    CHECK(client_command(FD_OPCODE_COMMIT, stage(40.0f, 6.0f, 20.0f, 0.0f)) == FD_RESULT_DONE);
}

#define NAMED(check) {#check, check}

const struct check stop_checks[] = {
    NAMED(a_loop_that_keeps_an_axis_swinging_is_ended),
    NAMED(a_coupling_that_breaks_in_a_motion_is_seen),
    NAMED(a_hand_that_pushes_is_no_oscillation),
    NAMED(a_stop_ends_whatever_moves),
    NAMED(the_window_ends_whatever_moves),
    NAMED(the_watchdog_ends_whatever_moves),
    NAMED(a_silent_host_loses_the_board_though_an_axis_moves),
    NAMED(an_effort_that_would_jump_is_refused_at_rest),
    NAMED(feedback_that_is_unstable_as_stated_is_refused),
};
const unsigned stop_check_count = sizeof stop_checks / sizeof stop_checks[0];
