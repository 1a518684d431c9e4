#include "publication.h"

#include "arming.h"
#include "capture_ring.h"
#include "commands.h"
#include "drive.h"
#include "gain_banks.h"
#include "gain_store.h"
#include "handover.h"
#include "identification.h"
#include "machine.h"
#include "port.h"
#include "register_file.h"
#include "session.h"

#define FIRMWARE_VERSION 0x0200u
#define LIMITS_STRIDE (FD_REG_LIMITS_Z_TRAVEL - FD_REG_LIMITS_X_TRAVEL)
#define MEASURED_STRIDE (FD_REG_MEASURED_Z_POSITION - FD_REG_MEASURED_X_POSITION)
#define BUMPLESS_STRIDE (FD_REG_BUMPLESS_Z_JUMP - FD_REG_BUMPLESS_X_JUMP)
#define STATED_STRIDE (FD_REG_STATED_Z_INERTIA - FD_REG_STATED_X_INERTIA)
#define TICK_US 10000u /* of times that are left */

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
        register_put_f32((uint16_t)(FD_REG_LIMITS_X_ACCELERATION + at),
                         limit->acceleration_rad_s2);
        register_put_f32((uint16_t)(FD_REG_BUMPLESS_X_JUMP_LIMIT + axis * BUMPLESS_STRIDE),
                         limit->effort_jump_nm);
        register_put_f32((uint16_t)(FD_REG_STATED_X_INERTIA + axis * STATED_STRIDE),
                         limit->inertia);
        register_put_f32((uint16_t)(FD_REG_STATED_X_VISCOUS_FRICTION + axis * STATED_STRIDE),
                         limit->viscous_friction);
        maxima[axis] = limit->gain_maximum;
    }
    register_put_gains(GAINS_MAXIMUM, maxima);
    register_put_u16(FD_REG_BUMPLESS_CAPABLE, handover_capable());
}

void publish_constants(void)
{
    put_identity(port_settings());
    put_limits(port_settings());
}

/* In ticks, rounded up so that 0 is said of nothing that is left; saturating, for a time that wraps
 * around would seem to be nearly over. */
static uint16_t ticks(uint32_t us)
{
    const uint32_t count = us / TICK_US + (us % TICK_US > 0);
    return (uint16_t)(count < UINT16_MAX ? count : UINT16_MAX);
}

static void put_state(void)
{
    register_put_u16(FD_REG_STATUS_STATE, (uint16_t)machine.state);
    register_put_u16(FD_REG_STATUS_FAULT_CODE, (uint16_t)machine.fault);
    register_put_u32(FD_REG_STATUS_FAULT_SAMPLE, machine.fault_sample);
    register_put_u32(FD_REG_STATUS_BOARD_CLOCK, machine.samples);
    register_put_u16(FD_REG_STATUS_LAST_TOKEN, commands_last_token());
    register_put_u16(FD_REG_STATUS_LAST_RESULT, (uint16_t)commands_last_result());
    register_put_u32(FD_REG_STATUS_SAMPLES_TO_CHECK, arming_samples_left());
    register_put_u32(FD_REG_SESSION_KEY, session_key());
    register_put_u16(FD_REG_SESSION_REMAINING, ticks(session_remaining_us()));
}

static void put_gain_state(void)
{
    register_put_u16(FD_REG_STATUS_STAGED_CRC_OK, gain_banks_staged_crc_ok());
    register_put_u16(FD_REG_STATUS_UNCONFIRMED, gain_banks_unconfirmed());
    register_put_u16(FD_REG_STATUS_CONFIRM_REMAINING, ticks(gain_banks_remaining_us()));
    register_put_u32(FD_REG_STATUS_STORES, gain_store_writes());
    for (uint16_t axis = 0; axis < FD_AXES; axis++) {
        register_put_f32((uint16_t)(FD_REG_BUMPLESS_X_JUMP + axis * BUMPLESS_STRIDE),
                         handover_jump_nm(axis));
    }
}

static void put_inputs_and_outputs(void)
{
    register_put_u16(FD_REG_STATUS_STO_ACTIVE, port_sto_active());
    register_put_u16(FD_REG_STATUS_STO_LATCHED, machine_sto());
    register_put_u16(FD_REG_STATUS_HOMED, port_homed());
    register_put_u16(FD_REG_STATUS_LIMIT_SWITCHES, port_limit_switches());
    register_put_u16(FD_REG_STATUS_ENABLED, drive_powered());
    register_put_u16(FD_REG_STATUS_BRAKE_RELEASED, drive_powered());
    for (uint16_t axis = 0; axis < FD_AXES; axis++) {
        const uint16_t at = (uint16_t)(axis * MEASURED_STRIDE);
        register_put_f32((uint16_t)(FD_REG_MEASURED_X_POSITION + at), drive_position_rad(axis));
        register_put_f32((uint16_t)(FD_REG_MEASURED_X_SPEED + at), drive_speed_rad_s(axis));
    }
}

static void put_capture(void)
{
    const struct capture_counters counters = capture_ring_counters();
    register_put_u32(FD_REG_CAPTURE_PAGES_WRITTEN, counters.pages_written);
    register_put_u32(FD_REG_CAPTURE_SAMPLES_CAPTURED, counters.samples);
    register_put_u32(FD_REG_CAPTURE_OVERFLOWS, counters.overflows);
    register_put_u32(FD_REG_CAPTURE_PAGES_ACKNOWLEDGED, counters.acknowledged);
}

void publish_status(void)
{
    put_state();
    put_gain_state();
    put_inputs_and_outputs();
    put_capture();
    identification_publish();
}
