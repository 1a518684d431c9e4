/* Checks of what moves, and of what must not. */
#include "checks.h"

#include <math.h>

#include "../commands.h"
#include "../controller.h"
#include "../drive.h"
#include "../gain_banks.h"
#include "../machine.h"
#include "../numbers.h"
#include "../setpoints.h"
#include "../trajectory_check.h"
#include "client.h"
#include "simulation.h"

static bool any_effort;

static void watch_effort(void)
{
    any_effort = any_effort || simulation.effort[0] != 0 || simulation.effort[1] != 0;
}

/* rate^2 overflows, and an amplitude of next to nothing times it is no number. */
static void full_torque_from_finite_numbers(void)
{
    check_set_up();
    simulation.on_effort = watch_effort;
    any_effort = false;
    check_arm_sine(1e-30f, 1e25f, 100u);
    CHECK(commands_last_result() == FD_RESULT_BAD_TRAJECTORY);
    CHECK(client_command(FD_OPCODE_START, FD_MAP_CRC) == FD_RESULT_WRONG_STATE);
    check_arm_sine(3e38f, 100.0f, 100u); /* finite, and its acceleration is not */
    CHECK(commands_last_result() == FD_RESULT_TRAJECTORY_LIMITS);
    simulation_samples(100);
    CHECK(!any_effort && machine.state == FD_STATE_IDLE);
}

/* Past ARM, as if that had a hole. */
static void setpoint_that_is_no_number_switches_the_effort_off(void)
{
    static struct trajectory trajectory;
    trajectory.kind = FD_TRAJECTORYKIND_MULTISINE;
    trajectory.lead_in_samples = 1u;
    trajectory.capture_samples = 100u;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        trajectory.axis[axis].components = 1u;
        trajectory.axis[axis].sines[0].amplitude_rad = 1e-30f;
        trajectory.axis[axis].sines[0].rate_rad_s = 1e25f;
    }
    check_set_up();
    simulation.on_effort = watch_effort;
    any_effort = false;
    machine_follow(&trajectory);
    simulation_samples(10);
    CHECK(machine.fault == FD_FAULT_NOT_FINITE && machine.state == FD_STATE_FAULT);
    CHECK(!any_effort && !drive_powered() && !simulation.brake_released);
}

static void effort_that_is_no_number_switches_both_axes_off(void)
{
    struct fd_gain_bank gains[FD_AXES] = {
        simulation.settings.axis[0].first_gains, simulation.settings.axis[1].first_gains,
    };
    check_set_up();
    gains[0].offset_feedforward = 3.0f;
    gains[1].offset_feedforward = NAN;
    drive_set_gains(gains);
    simulation_samples(1);
    CHECK(simulation.effort[0] == 0 && simulation.effort[1] == 0);
    CHECK(machine.fault == FD_FAULT_NOT_FINITE && machine.state == FD_STATE_FAULT);
}

static void clamps_and_conversions_take_any_number(void)
{
    bool finite = true;
    CHECK(clamped(20.0f, 12.0f, &finite) <= 12.0f && finite);
    CHECK(fabsf(clamped(NAN, 12.0f, &finite)) <= 0.0f && !finite);
    finite = true;
    CHECK(fabsf(clamped(-INFINITY, 12.0f, &finite)) <= 0.0f && !finite);
    CHECK(to_int16(1e9f) == INT16_MAX && to_int16(-1e9f) == -INT16_MAX && to_int16(NAN) == 0);
    CHECK(to_int32(1e30f) > 2147483000 && to_int32(-1e30f) < -2147483000 && to_int32(NAN) == 0);
    CHECK(counts_between(INT32_MIN, INT32_MAX) == 1 && counts_between(INT32_MAX, INT32_MIN) == -1);
    CHECK(counts_between(INT32_MIN, 0) == INT32_MIN && counts_between(5, 7) == -2);
}

static void encoder_counts_may_wrap_around(void)
{
    simulation_power_cycle();
    simulation.encoder_offset[0] = INT32_MAX - 200;
    simulation.encoder_offset[1] = INT32_MIN + 200;
    simulation_samples(30);
    for (unsigned n = 0; n < 60u; n++) { /* turned by hand: 10 counts a sample */
        simulation.encoder_offset[0] = counts_between(simulation.encoder_offset[0], -10);
        simulation.encoder_offset[1] = counts_between(simulation.encoder_offset[1], 10);
        simulation_samples(1);
        CHECK(n < 25u || fabsf(drive_speed_rad_s(0) - 10.0f * 400.0f * TWO_PI / 8400.0f) < 0.01f);
        CHECK(n < 25u || fabsf(drive_speed_rad_s(1) + 10.0f * 400.0f * TWO_PI / 8400.0f) < 0.01f);
        CHECK(!drive_at_rest());
    }
    simulation_samples(30);
    CHECK(drive_at_rest() && machine.state == FD_STATE_IDLE);
}

/* Way from a stop in full motion, QUICK_STOP sent again after every so many samples. */
static float way_of_stop(unsigned pause_samples)
{
    simulation_reset();
    check_set_up();
    check_arm_sine(1.0f, 3.0f, 4000u);
    CHECK(client_command(FD_OPCODE_START, FD_MAP_CRC) == FD_RESULT_DONE);
    while (machine.samples < 1000u) {
        simulation_samples(1);
        if (machine.samples % 200u == 0) {
            CHECK(client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY) == 0);
        }
    }
    const float begin = setpoints_current()[0].position_rad;
    while (machine.state == FD_STATE_MOVING || machine.state == FD_STATE_STOPPING) {
        client_command(FD_OPCODE_QUICK_STOP, 0);
        simulation_samples(pause_samples);
    }
    CHECK(machine.state == FD_STATE_IDLE);
    return setpoints_current()[0].position_rad - begin;
}

static void quick_stop_in_a_stop_is_no_longer(void)
{
    const float once = way_of_stop(1000u), often = way_of_stop(10u);
    CHECK(fabsf(once) > 0.1f && fabsf(often - once) < 1e-3f);
}

static void long_trajectories_do_not_block_the_line(void)
{
    check_set_up();
    uint16_t table[TABLE_WORDS];
    client_begin_table(table, FD_TRAJECTORYKIND_STAIRCASE, 240000u, 8640000u);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        client_set_u16(table, axis, FD_REG_TRAJECTORY_X_LEVELS, 1u);
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_ACCELERATION, 0, 1.0f);
    }
    CHECK(client_write_table(table));
    CHECK(client_command(FD_OPCODE_ARM, client_table_crc(table)) == FD_RESULT_PENDING);
    CHECK(machine.state == FD_STATE_CHECKING);
    const uint32_t before = client_u32(FD_REG_STATUS_SAMPLES_TO_CHECK);
    CHECK(before <= 8880000u && before > 8870000u);
    for (unsigned n = 0; n < 100u; n++) {
        CHECK(simulation_pass(0)); /* tells that more work waits */
    }
    const uint32_t after = client_u32(FD_REG_STATUS_SAMPLES_TO_CHECK);
    CHECK(before - after >= 1600u && before - after <= 1600u + 16u * 10u);
    CHECK(client_command(FD_OPCODE_START, FD_MAP_CRC) == FD_RESULT_WRONG_STATE);
    CHECK(client_command(FD_OPCODE_QUICK_STOP, 0) == FD_RESULT_DONE);
    CHECK(machine.state == FD_STATE_IDLE && !simulation_pass(0));
    CHECK(client_u16(FD_REG_STATUS_LAST_RESULT) == FD_RESULT_DONE);
}

static void fault_during_the_check_ends_it(void)
{
    check_set_up();
    check_arm_sine(0.5f, 1.0f, 100u);
    CHECK(machine.state == FD_STATE_ARMED);
    CHECK(client_command(FD_OPCODE_QUICK_STOP, 0) == FD_RESULT_DONE);
    CHECK(client_command(FD_OPCODE_ARM, client_u32(FD_REG_SHADOW_CRC)) == FD_RESULT_BAD_TRAJECTORY);
    uint16_t table[TABLE_WORDS];
    client_begin_table(table, FD_TRAJECTORYKIND_STAIRCASE, 400u, 100000u);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        client_set_u16(table, axis, FD_REG_TRAJECTORY_X_LEVELS, 1u);
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_ACCELERATION, 0, 1.0f);
    }
    CHECK(client_write_table(table));
    CHECK(client_command(FD_OPCODE_ARM, client_table_crc(table)) == FD_RESULT_PENDING);
    simulation_press_stop(true);
    simulation_samples(2);
    CHECK(machine.state == FD_STATE_FAULT && machine.fault == FD_FAULT_STO);
    CHECK(client_u16(FD_REG_STATUS_LAST_RESULT) == FD_RESULT_WRONG_STATE);
}

/* Feed-forward of the gains in force, and a first setpoint far from where the axis rests. */
static void efforts_and_jumps_are_limits_of_a_trajectory(void)
{
    static struct trajectory_check check;
    static struct trajectory trajectory;
    struct fd_gain_bank gains[FD_AXES] = {
        simulation.settings.axis[0].first_gains, simulation.settings.axis[1].first_gains,
    };
    const struct law_memory memory[FD_AXES] = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
    trajectory.kind = FD_TRAJECTORYKIND_STAIRCASE;
    trajectory.lead_in_samples = trajectory.capture_samples = 10u;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        trajectory.axis[axis].stairs.levels = 1u;
        trajectory.axis[axis].stairs.acceleration_rad_s2 = 1.0f;
    }
    trajectory_check_begin(&check, &trajectory, gains, memory);
    CHECK(trajectory_check_go_on(&check, 100u) && check.samples_left == 0);
    trajectory_check_begin(&check, &trajectory, gains, memory);
    check.memory[1].reference_rad = 0.02f; /* a sample at the speed limit is 0.01 rad */
    CHECK(!trajectory_check_go_on(&check, 1u));
    gains[1].offset_feedforward = 12.1f;
    trajectory_check_begin(&check, &trajectory, gains, memory);
    CHECK(!trajectory_check_go_on(&check, 1u));
}

const struct check motion_checks[] = {
    {"full_torque_from_finite_numbers", full_torque_from_finite_numbers},
    {"setpoint_that_is_no_number_switches_the_effort_off",
     setpoint_that_is_no_number_switches_the_effort_off},
    {"effort_that_is_no_number_switches_both_axes_off",
     effort_that_is_no_number_switches_both_axes_off},
    {"clamps_and_conversions_take_any_number", clamps_and_conversions_take_any_number},
    {"encoder_counts_may_wrap_around", encoder_counts_may_wrap_around},
    {"quick_stop_in_a_stop_is_no_longer", quick_stop_in_a_stop_is_no_longer},
    {"long_trajectories_do_not_block_the_line", long_trajectories_do_not_block_the_line},
    {"fault_during_the_check_ends_it", fault_during_the_check_ends_it},
    {"efforts_and_jumps_are_limits_of_a_trajectory", efforts_and_jumps_are_limits_of_a_trajectory},
};
const unsigned motion_check_count = sizeof motion_checks / sizeof motion_checks[0];
