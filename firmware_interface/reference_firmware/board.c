#include "board.h"

#include <string.h>

#include "capture_ring.h"
#include "commands.h"
#include "gain_banks.h"
#include "gain_store.h"
#include "machine.h"
#include "modbus_rtu.h"
#include "port.h"

#define FIRMWARE_VERSION 0x0100u
#define COMMAND_WORDS 4u
#define LIMITS_STRIDE (FD_REG_LIMITS_Z_TRAVEL - FD_REG_LIMITS_X_TRAVEL)
#define TICK_US 10000u /* of confirm_remaining */

static void put_identity(const struct board_settings *settings)
{
    register_put_u32(FD_REG_IDENTITY_MAGIC, FD_MAGIC);
    register_put_u16(FD_REG_IDENTITY_MAP_VERSION, FD_MAP_VERSION);
    register_put_u16(FD_REG_IDENTITY_FIRMWARE_VERSION, FIRMWARE_VERSION);
    register_put_u32(FD_REG_IDENTITY_MAP_CRC, FD_MAP_CRC);
    register_put_u32(FD_REG_IDENTITY_SERIAL_NUMBER, settings->serial_number);
    register_put_f32(FD_REG_IDENTITY_FLOAT_TEST, FD_FLOAT_TEST);
    register_put_u32(FD_REG_IDENTITY_NONCE, port_random());
    register_put_u32(FD_REG_IDENTITY_SAMPLE_PERIOD, SAMPLE_PERIOD_NS);
    register_put_u32(FD_REG_IDENTITY_CONTROL_DELAY, settings->control_delay_ns);
    register_put_u32(FD_REG_IDENTITY_COUNTS_PER_TURN, settings->counts_per_turn);
    register_put_f32(FD_REG_IDENTITY_EFFORT_PER_COUNT, settings->effort_per_count_nm);
}

static void put_limits(const struct board_settings *settings)
{
    struct fd_gain_bank maxima[FD_AXES];
    for (uint16_t axis = 0; axis < FD_AXES; axis++) {
        const struct axis_settings *limit = &settings->axis[axis];
        const uint16_t at = (uint16_t)(axis * LIMITS_STRIDE);
        register_put_f32((uint16_t)(FD_REG_LIMITS_X_TRAVEL + at), limit->travel_rad);
        register_put_f32((uint16_t)(FD_REG_LIMITS_X_SPEED + at), limit->speed_rad_s);
        register_put_f32((uint16_t)(FD_REG_LIMITS_X_EFFORT + at), limit->effort_nm);
        register_put_f32((uint16_t)(FD_REG_LIMITS_X_FOLLOWING_ERROR + at),
                         limit->following_error_rad);
        register_put_f32((uint16_t)(FD_REG_LIMITS_X_GAIN_STEP + at), limit->gain_step);
        maxima[axis] = limit->gain_maximum;
    }
    register_put_gains(FD_REG_GAIN_MAXIMUM_X_PROPORTIONAL, LIMITS_STRIDE, maxima);
}

void board_power_up(void)
{
    const struct board_settings *settings = port_settings();
    struct fd_gain_bank gains[FD_AXES];
    put_identity(settings);
    put_limits(settings);
    register_put_u16(FD_REG_WATCHDOG_TIMEOUT, 1000u);
    register_put_u16(FD_REG_WATCHDOG_ACTION, FD_WATCHDOGACTION_QUICK_STOP);
    if (!gain_store_load(gains)) {
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            gains[axis] = settings->axis[axis].first_gains;
        }
    }
    gain_banks_init(gains);
    machine_init();
}

void board_sample(void)
{
    machine_sample();
}

void board_poll(void)
{
    modbus_rtu_poll();
}

void board_frame_seen(void)
{
    port_lock();
    machine.last_frame_us = port_time_us();
    port_unlock();
}

/* Put the status where the host reads it. */
static void publish(void)
{
    const uint32_t remaining_us = gain_banks_remaining_us();
    register_put_u16(FD_REG_STATUS_STATE, (uint16_t)machine.state);
    register_put_u16(FD_REG_STATUS_FAULT_CODE, (uint16_t)machine.fault);
    register_put_u32(FD_REG_STATUS_FAULT_SAMPLE, machine.fault_sample);
    register_put_u16(FD_REG_STATUS_STO_ACTIVE, port_sto_active());
    register_put_u16(FD_REG_STATUS_LAST_TOKEN, commands_last_token());
    register_put_u16(FD_REG_STATUS_LAST_RESULT, (uint16_t)commands_last_result());
    register_put_u16(FD_REG_STATUS_STAGED_CRC_OK, gain_banks_staged_crc_ok());
    register_put_u16(FD_REG_STATUS_UNCONFIRMED, gain_banks_unconfirmed());
    register_put_u16(FD_REG_STATUS_CONFIRM_REMAINING, (uint16_t)(remaining_us / TICK_US));
    register_put_u32(FD_REG_STATUS_BOARD_CLOCK, machine.samples);
    capture_ring_publish();
}

enum access board_read(uint16_t address, uint16_t count, uint16_t *words)
{
    port_lock();
    publish();
    const enum access result = register_file_read(address, count, words);
    port_unlock();
    return result;
}

enum access board_write(uint16_t address, uint16_t count, const uint16_t *words)
{
    const bool command = address < FD_REG_COMMAND_OPCODE + COMMAND_WORDS
        && address + count > FD_REG_COMMAND_OPCODE;
    if (command && (address != FD_REG_COMMAND_OPCODE || count != COMMAND_WORDS)) {
        return ACCESS_NO_REGISTER; /* a command comes whole or not at all */
    }
    port_lock();
    const enum access result = register_file_write(address, count, words);
    port_unlock();
    if (result == ACCESS_DONE) {
        gain_banks_check_staged();
    }
    if (command) {
        commands_execute(register_u16(FD_REG_COMMAND_OPCODE), register_u16(FD_REG_COMMAND_TOKEN),
                         register_u32(FD_REG_COMMAND_ARGUMENT));
    }
    return result;
}
