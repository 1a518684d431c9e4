/* Checks of power-up, inputs, permanent memory and frames. */
#include "checks.h"

#include <math.h>
#include <string.h>

#include "../crc.h"
#include "../drive.h"
#include "../gain_banks.h"
#include "../machine.h"
#include "client.h"
#include "simulation.h"

static void power_up_leaves_the_effort_off(void)
{
    simulation.plants[0].velocity_rad_s = 2.0; /* nobody knows that the axis stands */
    simulation_power_cycle();
    simulation_samples(10);
    CHECK(machine.state == FD_STATE_IDLE && simulation.effort[0] == 0);
    CHECK(!simulation.brake_released && client_u16(FD_REG_STATUS_ENABLED) == 0);
    CHECK(client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY) == 0);
    CHECK(client_command(FD_OPCODE_ENABLE, 0) == FD_RESULT_NOT_AT_REST);
    simulation_samples(1000);
    CHECK(client_command(FD_OPCODE_ENABLE, 0) == FD_RESULT_DONE && simulation.brake_released);
}

/* Numbers that are none, and below zero. */
static void spoil_float(struct board_settings *settings, unsigned which)
{
    struct axis_settings *axis = &settings->axis[1];
    float *const numbers[] = {
        &settings->effort_per_count_nm, &axis->travel_rad, &axis->speed_rad_s,
        &axis->acceleration_rad_s2, &axis->effort_nm, &axis->following_error_rad, &axis->gain_step,
        &axis->gain_maximum.proportional, &axis->gain_maximum.ripple_period[3],
        &axis->first_gains.coulomb_smoothing, &axis->first_gains.inertia_feedforward,
        &axis->gain_maximum.load_table[23], &axis->first_gains.presliding_distance,
        &axis->effort_jump_nm,
    };
    static const float spoilt[] = {NAN, INFINITY, -1.0f};
    *numbers[which / 3u] = spoilt[which % 3u];
}

#define FLOAT_SPOILS (3u * 14u)

/* Numbers that something else cannot bear. */
static void spoil_size(struct board_settings *settings, unsigned which)
{
    struct axis_settings *axis = &settings->axis[1];
    switch (which) {
    case 0: settings->counts_per_turn = 0; break;
    case 1: settings->frame_gap_us = 0; break;
    case 2: settings->turnaround_us = 2000000u; break;
    case 3: settings->confirm_window_us = 1800000000u; break;
    case 4: settings->confirm_window_us = 0; break;
    case 5: axis->effort_nm = 32768.0f * settings->effort_per_count_nm; break;
    case 6: axis->travel_rad = 900000.0f; break; /* in counts, too near to the counter's end */
    case 7: axis->gain_step = 1.5f; break;
    case 8: axis->gain_maximum.transmission_loss = 1.0f; break; /* the law would divide by zero */
    default: axis->first_gains.proportional = 601.0f; break;
    }
}

#define SIZE_SPOILS 10u

static void bad_settings_fail_the_self_test_for_good(void)
{
    simulation_power_cycle();
    simulation_samples(30);
    CHECK(machine.state == FD_STATE_IDLE);
    for (unsigned which = 0; which < FLOAT_SPOILS + SIZE_SPOILS; which++) {
        simulation_reset();
        if (which < FLOAT_SPOILS) {
            spoil_float(&simulation.settings, which);
        } else {
            spoil_size(&simulation.settings, which - FLOAT_SPOILS);
        }
        simulation_power_cycle();
        simulation.settings.frame_gap_us = LINE_GAP_US; /* so that the line can be used to ask */
        simulation.settings.turnaround_us = LINE_GAP_US;
        simulation_samples(30);
        CHECK(machine.state == FD_STATE_FAULT && machine.fault == FD_FAULT_SELF_TEST);
        CHECK(client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY) == 0);
        CHECK(client_command(FD_OPCODE_CLEAR_FAULT, 0) == FD_RESULT_WRONG_STATE);
        CHECK(client_command(FD_OPCODE_ENABLE, 0) == FD_RESULT_WRONG_STATE);
        CHECK(machine.state == FD_STATE_FAULT && !drive_powered());
    }
}

static void stop_pulse_between_two_samples_is_seen(void)
{
    check_set_up();
    simulation_press_stop(true);
    simulation_press_stop(false);
    simulation_samples(1);
    CHECK(machine.fault == FD_FAULT_STO && !drive_powered() && !simulation.brake_released);
    CHECK(client_u16(FD_REG_STATUS_STO_ACTIVE) == 0 && client_u16(FD_REG_STATUS_STO_LATCHED) == 1);
    simulation_press_stop(true);
    simulation_samples(30);
    CHECK(client_command(FD_OPCODE_CLEAR_FAULT, 0) == FD_RESULT_STO_ACTIVE);
    simulation_press_stop(false);
    CHECK(client_command(FD_OPCODE_CLEAR_FAULT, 0) == FD_RESULT_DONE);
    CHECK(machine.state == FD_STATE_IDLE && client_u16(FD_REG_STATUS_STO_LATCHED) == 0);
    CHECK(!drive_powered());
    simulation_press_stop(true); /* with the effort off, too */
    simulation_press_stop(false);
    simulation_samples(1);
    CHECK(machine.fault == FD_FAULT_STO);
}

static void a_pressed_limit_switch_lets_an_axis_only_away(void)
{
    check_set_up();
    check_arm_sine(0.5f, 2.0f, 4000u);
    simulation.limit_switches = 2u << 2; /* axis z, positive end; the lead-in begins backwards */
    CHECK(client_command(FD_OPCODE_START, FD_MAP_CRC) == FD_RESULT_DONE);
    while (machine.state == FD_STATE_MOVING && simulation.plants[1].velocity_rad_s < 0.05) {
        simulation_samples(1);
        CHECK(client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY) == 0);
    }
    CHECK(simulation.plants[1].position_rad < -0.05);
    CHECK(machine.fault == FD_FAULT_LIMIT_SWITCH && !drive_powered());
}

/* The bank in force with another proportional gain, committed, confirmed and stored. */
static enum fd_result stored(float proportional)
{
    struct fd_gain_bank gains[FD_AXES];
    memcpy(gains, gain_banks_active(), sizeof gains);
    gains[0].proportional = proportional;
    const uint32_t crc = client_stage(gains);
    CHECK(client_command(FD_OPCODE_COMMIT, crc + 1u) == FD_RESULT_GAIN_CRC);
    CHECK(client_command(FD_OPCODE_COMMIT, crc) == FD_RESULT_DONE);
    CHECK(client_command(FD_OPCODE_CONFIRM, 0) == FD_RESULT_DONE);
    return client_command(FD_OPCODE_STORE, FD_STORE_SIGNATURE);
}

static void store_writes_only_what_changed_and_counts(void)
{
    check_set_up();
    CHECK(client_u32(FD_REG_STATUS_STORES) == 0);
    CHECK(stored(40.0f) == FD_RESULT_DONE && stored(40.0f) == FD_RESULT_DONE);
    CHECK(client_u32(FD_REG_STATUS_STORES) == 1u && simulation.memory_writes == 1u);
    CHECK(stored(50.0f) == FD_RESULT_DONE && stored(40.0f) == FD_RESULT_DONE);
    CHECK(client_u32(FD_REG_STATUS_STORES) == 3u && simulation.memory_writes == 3u);
    check_set_up();
    CHECK(client_u32(FD_REG_STATUS_STORES) == 3u);
    CHECK(fabsf(gain_banks_active()[0].proportional - 40.0f) < 1e-6f);
    CHECK(client_command(FD_OPCODE_STORE, FD_STORE_SIGNATURE) == FD_RESULT_DONE);
    CHECK(client_u32(FD_REG_STATUS_STORES) == 3u && simulation.memory_writes == 3u);
}

/* What firmware of map 3 left in a slot: both axes with this proportional gain, and soft. */
static void store_of_map_3(unsigned slot, uint32_t sequence, float proportional)
{
    const float row[24] = {proportional, 4.0f, 0, 0, 0, 0, 0, 0.5f, 0, 0, 1.0f, 0,
                           0, 0, 0, 0, 0, 0, 0, 0, 1.0f, 1.0f, 1.0f, 1.0f};
    const uint32_t map_crc = 0x58329fe3u;
    unsigned char *record = simulation.memory[slot];
    uint16_t words[100];
    memcpy(record, &map_crc, 4u);
    memcpy(record + 4, &sequence, 4u);
    memcpy(record + 8, row, 96u);
    memcpy(record + 104, row, 96u);
    memcpy(words, record, 200u);
    const uint32_t crc = crc32_of_words(words, 100u);
    memcpy(record + 200, &crc, 4u);
}

static void gains_that_map_3_stored_stay_in_force(void)
{
    store_of_map_3(0, 7u, 40.0f);
    store_of_map_3(1u, 8u, 50.0f);
    check_set_up();
    CHECK(client_u32(FD_REG_STATUS_STORES) == 8u);
    CHECK(fabsf(gain_banks_active()[1].proportional - 50.0f) < 1e-6f);
    CHECK(memcmp(gain_banks_active()[0].load_table, gain_banks_off()->load_table, 96u) == 0);
    CHECK(client_command(FD_OPCODE_STORE, FD_STORE_SIGNATURE) == FD_RESULT_DONE);
    CHECK(client_u32(FD_REG_STATUS_STORES) == 8u && simulation.memory_writes == 0);
    CHECK(stored(60.0f) == FD_RESULT_DONE && simulation.memory_writes == 1u);
    simulation.memory[0][300] ^= 1u; /* cut in the middle of the write: the slot of map 3 is whole */
    check_set_up();
    CHECK(fabsf(gain_banks_active()[0].proportional - 50.0f) < 1e-6f);
    simulation.memory[1][100] ^= 1u;
    check_set_up();
    CHECK(fabsf(gain_banks_active()[0].proportional - 30.0f) < 1e-6f);
}

static void time_to_confirm_is_shown_saturating(void)
{
    simulation.settings.confirm_window_us = 1700000000u;
    check_set_up();
    CHECK(stored(40.0f) == FD_RESULT_DONE);
    CHECK(client_u16(FD_REG_STATUS_CONFIRM_REMAINING) == 0);
    uint16_t words[BANK_WORDS];
    client_bank_words(gain_banks_active(), words);
    CHECK(client_command(FD_OPCODE_COMMIT, crc32_of_words(words, BANK_WORDS)) == FD_RESULT_DONE);
    CHECK(client_u16(FD_REG_STATUS_CONFIRM_REMAINING) == UINT16_MAX);
    for (unsigned s = 0; s < 1100u; s++) {
        simulation_pass(1000000u);
    }
    CHECK(client_u16(FD_REG_STATUS_CONFIRM_REMAINING) < 60000u);
    CHECK(client_u16(FD_REG_STATUS_UNCONFIRMED) == 1u);
}

/* Two requests in one burst: the first is carried out, the second would be for nothing. */
static void of_frames_back_to_back_the_first_is_carried_out(void)
{
    check_set_up();
    uint8_t burst[64] = {1u, 6u, 0u, FD_REG_WATCHDOG_TIMEOUT, 0x03u, 0x00u};
    uint8_t second[16] = {1u, 6u, 0u, FD_REG_WATCHDOG_TIMEOUT, 0x04u, 0x00u};
    const size_t length = client_close_frame(burst, 6u), more = client_close_frame(second, 6u);
    memcpy(&burst[length], second, more);
    const unsigned long before = simulation.replies;
    CHECK(simulation_exchange(burst, length + more) == 8u && simulation.replies == before + 1u);
    CHECK(simulation.reply[4] == 0x03u && client_u16(FD_REG_WATCHDOG_TIMEOUT) == 0x0300u);
}

static void every_other_function_is_refused(void)
{
    simulation_power_cycle();
    for (unsigned code = 0; code < 256u; code++) {
        uint8_t frame[16] = {1u, (uint8_t)code, 0u, 0u, 0u, 1u, 7u, 7u, 7u, 7u};
        const bool known = code == 3u || code == 6u || code == 16u;
        for (size_t length = 2u; length <= 10u && !known; length += 2u) {
            uint8_t sent[16];
            memcpy(sent, frame, sizeof sent);
            CHECK(simulation_exchange(sent, client_close_frame(sent, length)) == 5u);
            CHECK(simulation.reply[1] == (code | 0x80u) && simulation.reply[2] == 1u);
        }
    }
}

const struct check board_checks[] = {
    {"power_up_leaves_the_effort_off", power_up_leaves_the_effort_off},
    {"bad_settings_fail_the_self_test_for_good", bad_settings_fail_the_self_test_for_good},
    {"stop_pulse_between_two_samples_is_seen", stop_pulse_between_two_samples_is_seen},
    {"a_pressed_limit_switch_lets_an_axis_only_away",
     a_pressed_limit_switch_lets_an_axis_only_away},
    {"store_writes_only_what_changed_and_counts", store_writes_only_what_changed_and_counts},
    {"gains_that_map_3_stored_stay_in_force", gains_that_map_3_stored_stay_in_force},
    {"time_to_confirm_is_shown_saturating", time_to_confirm_is_shown_saturating},
    {"of_frames_back_to_back_the_first_is_carried_out",
     of_frames_back_to_back_the_first_is_carried_out},
    {"every_other_function_is_refused", every_other_function_is_refused},
};
const unsigned board_check_count = sizeof board_checks / sizeof board_checks[0];
