#include "fuzz_invariants.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../capture_ring.h"
#include "../commands.h"
#include "../crc.h"
#include "../drive.h"
#include "../gain_banks.h"
#include "../handover.h"
#include "../machine.h"
#include "../register_file.h"
#include "../session.h"
#include "../setpoints.h"
#include "simulation.h"

/* A stop of a whole number of samples is at most half a sample longer than was reckoned with. */
#define STOP_MARGIN_RAD 0.003f
/* By docs/safety.md a stop takes 0.5 s at most and 2 s until the axes stand, whatever moves them;
 * gains are taken back in one that follows on the end of a motion. */
#define LONGEST_STOP_SAMPLES 1010u
#define LONGEST_WAY_BACK_SAMPLES (2u * LONGEST_STOP_SAMPLES)

struct seen invariants_seen;

static struct {
    enum fd_state state;
    enum fd_result result;
    bool powered;
    uint32_t holder;
    unsigned long replies;
    uint32_t samples;
} before;

/* As the last call of the main loop left it; since then there were only samples. */
static struct {
    unsigned long power_ups;
    bool powered, guarded; /* a motion of the holder, which owes a sign of life */
    uint32_t holder;
} left;

static struct {
    unsigned long power_ups;
    struct fd_gain_bank in_force[FD_AXES], earlier[FD_AXES];
} bank;

static struct {
    enum fd_state state;
    uint32_t stop, way_back; /* for so many samples */
} lasting;

static bool unconfirmed; /* as the last sample or call of the main loop left it */

static void hold(bool holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "broken: %s (state %d, fault %d)\n", what, (int)machine.state,
                (int)machine.fault);
        abort();
    }
}

/* ---- at every sample */

static bool moves(enum fd_state state)
{
    return state == FD_STATE_MOVING || state == FD_STATE_DRAINING || state == FD_STATE_STOPPING;
}

static void check_setpoint(unsigned axis)
{
    const struct setpoint *setpoint = &setpoints_current()[axis];
    const struct axis_settings *limit = &simulation.settings.axis[axis];
    const float margin_rad = machine.state == FD_STATE_MOVING ? 0.0f : STOP_MARGIN_RAD;
    hold(fabsf(setpoint->velocity_rad_s) <= 0.0f || moves(machine.state), "motion without START");
    if (moves(machine.state)) {
        hold(fabsf(setpoint->position_rad) <= limit->travel_rad + margin_rad, "travel left");
        hold(fabsf(setpoint->velocity_rad_s) <= limit->speed_rad_s, "speed above its limit");
        hold(fabsf(setpoint->acceleration_rad_s2) <= limit->acceleration_rad_s2,
             "acceleration above its limit");
    }
    if (machine.state == FD_STATE_MOVING) {
        const struct fd_gain_bank *gains = &gain_banks_active()[axis];
        const struct setpoint *other = &setpoints_current()[OTHER_AXIS(axis)];
        const float effort = law_feedforward_nm(gains, setpoint, other, drive_memory(axis));
        hold(fabsf(law_output_nm(gains, effort)) <= limit->effort_nm,
             "feed-forward above the effort limit");
    }
}

/* Gains that a sample puts in force, not a command. */
static void check_exchange(void)
{
    if (gain_banks_unconfirmed() && !unconfirmed) {
        hold(machine.state == FD_STATE_IDLE || machine.state == FD_STATE_DRAINING
                 || machine.state == FD_STATE_DONE, "gains exchanged in a motion or a stop");
        hold(drive_powered() && machine.fault == FD_FAULT_NONE, "gains exchanged without effort");
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            hold(fabsf(handover_jump_nm(axis)) <= simulation.settings.axis[axis].effort_jump_nm,
                 "effort jumped beyond its limit");
        }
        invariants_seen.exchanges += setpoints_moving();
    }
    unconfirmed = gain_banks_unconfirmed();
}

static void check_effort(void)
{
    bool effort = false;
    check_exchange();
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const float limit_counts = roundf(simulation.settings.axis[axis].effort_nm
                                          / simulation.settings.effort_per_count_nm);
        hold(fabsf((float)simulation.effort[axis]) <= limit_counts, "effort beyond its limit");
        effort = effort || simulation.effort[axis] != 0;
    }
    if (effort) {
        hold(drive_powered(), "effort while not enabled");
        hold(machine.state != FD_STATE_FAULT && machine.state != FD_STATE_INIT, "effort in fault");
        hold(setpoints_finite(), "effort for a setpoint that is no number");
    }
    for (unsigned axis = 0; axis < FD_AXES && drive_powered(); axis++) {
        check_setpoint(axis);
    }
    hold(machine.state != FD_STATE_MOVING || machine.fault != FD_FAULT_NONE
             || session_silence_us() <= 1000u * register_u16(FD_REG_WATCHDOG_TIMEOUT),
         "motion of a host that is silent");
    invariants_seen.samples_with_effort += effort;
    invariants_seen.samples_in_motion += machine.state == FD_STATE_MOVING;
    invariants_seen.samples_in_fault += machine.state == FD_STATE_FAULT;
}

/* A stop, and the way back to the gains of before, ends whatever moves. */
static void check_ends(void)
{
    const uint32_t passed = machine.samples - before.samples;
    const bool rests = machine.state == FD_STATE_DRAINING && drive_at_rest();
    const bool stops = machine.state == FD_STATE_STOPPING
        || (machine.state == FD_STATE_DRAINING && !rests && !setpoints_moving());
    const bool same = lasting.state == machine.state; /* a stop of DRAINING is another stop */
    lasting.stop = stops && same && drive_powered() ? lasting.stop + passed : 0;
    lasting.state = machine.state;
    lasting.way_back =
        machine.roll_back_due && machine.state != FD_STATE_MOVING ? lasting.way_back + passed : 0;
    hold(lasting.stop <= LONGEST_STOP_SAMPLES, "a stop lasts longer than it may");
    hold(lasting.way_back <= LONGEST_WAY_BACK_SAMPLES, "the gains of before do not come back");
}

/* The wired stop was pressed when the last sample came. */
static void check_stop(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        hold(!simulation.stop_pressed || simulation.effort[axis] == 0, "effort under STO");
    }
    hold(!simulation.stop_pressed || !drive_powered(), "enabled under STO");
}

/* Gains come into force whole: those staged, or those of before. */
static void check_bank(void)
{
    const struct fd_gain_bank *active = gain_banks_active();
    const bool new_board = bank.power_ups != simulation.power_ups;
    if (!new_board && memcmp(active, bank.in_force, sizeof bank.in_force) == 0) {
        return;
    }
    struct fd_gain_bank shadow[FD_AXES];
    register_take_gains(GAINS_SHADOW, shadow);
    hold(new_board || memcmp(active, shadow, sizeof shadow) == 0
             || memcmp(active, bank.earlier, sizeof bank.earlier) == 0,
         "gains in force that are a mixture");
    hold(register_u32(FD_REG_ACTIVE_CRC) == register_gains_crc(GAINS_ACTIVE),
         "the active bank's CRC is wrong");
    bank.power_ups = simulation.power_ups;
    memcpy(bank.earlier, bank.in_force, sizeof bank.earlier);
    memcpy(bank.in_force, active, sizeof bank.in_force);
}

/* ---- around every call of the main loop, which carries out one request at most */

/* What no sample may do by itself. */
static void check_samples(void)
{
    if (simulation.power_ups != left.power_ups) {
        memset(&left, 0, sizeof left);
    }
    hold(left.powered || !drive_powered(), "enabled by itself");
    hold(session_key() == left.holder || (session_key() == 0 && !left.guarded),
         "the host was lost in a motion");
}

static void look_before(void)
{
    check_samples();
    check_bank();
    if (before.samples != machine.samples) {
        check_stop();
        check_ends();
    }
    before.samples = machine.samples;
    before.state = machine.state;
    before.result = commands_last_result();
    before.powered = drive_powered();
    before.holder = session_key();
    before.replies = simulation.replies;
}

/* Whether the command that was written last is this one, and from the host that held the board. */
static bool asked_for(enum fd_opcode opcode)
{
    return register_u16(FD_REG_COMMAND_OPCODE) == opcode && before.holder != 0
        && register_u32(FD_REG_COMMAND_KEY) == before.holder;
}

static void check_asked_for(void)
{
    if (machine.state == FD_STATE_MOVING && before.state != FD_STATE_MOVING) {
        hold(before.state == FD_STATE_ARMED && asked_for(FD_OPCODE_START)
                 && register_u32(FD_REG_COMMAND_ARGUMENT) == FD_MAP_CRC,
             "MOVING without START by the holder");
        invariants_seen.starts++;
    }
    if (drive_powered() && !before.powered) {
        hold(before.state == FD_STATE_IDLE && asked_for(FD_OPCODE_ENABLE),
             "enabled without ENABLE by the holder");
        invariants_seen.enables++;
    }
}

static void check_holder(void)
{
    const bool stopped = register_u16(FD_REG_COMMAND_OPCODE) == FD_OPCODE_QUICK_STOP
        && register_u32(FD_REG_COMMAND_KEY) != before.holder;
    hold(session_key() == before.holder || before.holder == 0 || session_key() == 0,
         "one host took over from another");
    hold(session_key() == before.holder || before.holder == 0 || !machine_busy()
             || stopped, "let go of the host in a motion");
    hold(session_key() != 0 || machine.state != FD_STATE_MOVING, "a motion that nobody holds");
}

static void check_reply(void)
{
    const uint8_t *bytes = simulation.reply;
    const size_t length = simulation.reply_length;
    hold(simulation.replies == before.replies + 1u, "more than one answer");
    hold(length >= 5u && length <= 256u && bytes[0] == 1u
             && crc16(bytes, length - 2u) == (bytes[length - 2u] | bytes[length - 1u] << 8),
         "an answer is no frame");
    invariants_seen.replies++;
    invariants_seen.exceptions += (bytes[1] & 0x80u) != 0;
}

static void look_after(void)
{
    const struct capture_counters capture = capture_ring_counters();
    check_asked_for();
    check_holder();
    check_bank();
    if (simulation.replies != before.replies) {
        check_reply();
    }
    hold(setpoints_finite(), "a setpoint is no number");
    hold(machine.fault != FD_FAULT_NOT_FINITE, "ARM let a number pass that is none");
    hold(drive_powered() || !simulation.brake_released, "brake released while not enabled");
    hold(capture.acknowledged <= capture.pages_written, "more pages acknowledged than written");
    hold(capture.overflows <= capture.pages_written, "false overflows");
    unconfirmed = gain_banks_unconfirmed();
    left.power_ups = simulation.power_ups;
    left.powered = drive_powered();
    left.guarded = (setpoints_moving() || machine.state == FD_STATE_DRAINING)
        && machine.fault == FD_FAULT_NONE;
    left.holder = session_key();
    invariants_seen.refused_trajectories += before.result == FD_RESULT_PENDING
        && commands_last_result() == FD_RESULT_TRAJECTORY_LIMITS;
}

void invariants_watch(void)
{
    memset(&before, 0, sizeof before);
    memset(&left, 0, sizeof left);
    memset(&bank, 0, sizeof bank);
    memset(&lasting, 0, sizeof lasting);
    unconfirmed = false;
    simulation.on_effort = check_effort;
    simulation.before_poll = look_before;
    simulation.after_poll = look_after;
}
