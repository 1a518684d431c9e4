/* The register map. Generated from registers.toml by firmware_interface/generate.py; do not edit. */
#ifndef FEED_DRIVE_REGISTERS_H
#define FEED_DRIVE_REGISTERS_H

#include <stddef.h>
#include <stdint.h>

#define FD_MAGIC 0x4d464453u
#define FD_MAP_VERSION 1u
#define FD_MAP_CRC 0x26483636u
#define FD_STORE_SIGNATURE 0x65766173u
#define FD_AXES 2u
#define FD_PAGE_ADDRESS 0x1000u
#define FD_PAGE_SLOTS 256u
#define FD_PAGE_SLOT_REGISTERS 128u
#define FD_PAGE_SAMPLES 14u
#define FD_PAGE_WORDS 119u

/* State of the board. */
enum fd_state {
    FD_STATE_INIT = 0, /* self-test after power-up */
    FD_STATE_IDLE = 1, /* holds its position, takes commands */
    FD_STATE_ARMED = 2, /* the trajectory is checked, START may follow */
    FD_STATE_MOVING = 3, /* lead-in and captured motion */
    FD_STATE_DRAINING = 4, /* capture is complete: comes to rest, pages still to be fetched */
    FD_STATE_DONE = 5, /* at rest, every page acknowledged */
    FD_STATE_FAULT = 6, /* latched until CLEAR_FAULT, effort off */
    FD_STATE_STOPPING = 7, /* decelerates to rest */
};

/* Why the board is in FAULT. */
enum fd_fault {
    FD_FAULT_NONE = 0, /* no fault */
    FD_FAULT_SELF_TEST = 1, /* the self-test after power-up failed */
    FD_FAULT_TRAVEL = 2, /* an axis left its travel range */
    FD_FAULT_SPEED = 3, /* an axis was faster than its speed limit */
    FD_FAULT_FOLLOWING_ERROR = 4, /* an axis fell too far behind its reference */
    FD_FAULT_WATCHDOG = 5, /* no valid frame came from the host in time */
    FD_FAULT_STO = 6, /* the wired emergency stop cut the effort */
};

/* Commands; each is written with a fresh token and its argument in one write. */
enum fd_opcode {
    FD_OPCODE_ARM = 1, /* check the trajectory, take the present position as rest */
    FD_OPCODE_START = 2, /* start the armed motion; argument: the map CRC */
    FD_OPCODE_QUICK_STOP = 3, /* decelerate to rest; no safety function */
    FD_OPCODE_FINISH = 4, /* leave DONE for IDLE */
    FD_OPCODE_CLEAR_FAULT = 5, /* leave FAULT for IDLE, at rest only */
    FD_OPCODE_COMMIT = 6, /* swap the shadow bank into the active one where the axes stand, keep the old one */
    FD_OPCODE_CONFIRM = 7, /* keep the committed gains */
    FD_OPCODE_ROLL_BACK = 8, /* return to the gains before the last COMMIT */
    FD_OPCODE_STORE = 9, /* write confirmed gains to permanent memory; argument: 0x65766173 */
};

/* What became of the last command. */
enum fd_result {
    FD_RESULT_NONE = 0, /* no command yet */
    FD_RESULT_DONE = 1, /* carried out */
    FD_RESULT_UNKNOWN_COMMAND = 2, /* the board does not know this command */
    FD_RESULT_WRONG_STATE = 3, /* not allowed in the board's present state */
    FD_RESULT_WRONG_ARGUMENT = 4, /* the argument is not the expected signature */
    FD_RESULT_BAD_TRAJECTORY = 5, /* the trajectory is incomplete or not finite */
    FD_RESULT_TRAJECTORY_LIMITS = 6, /* the trajectory would leave the travel or speed limits */
    FD_RESULT_GAIN_CRC = 7, /* the shadow bank does not match its CRC */
    FD_RESULT_GAIN_LIMITS = 8, /* a staged gain is outside the board's limits or changes too much at once */
    FD_RESULT_UNCONFIRMED = 9, /* gains committed before are not confirmed yet */
    FD_RESULT_NOTHING_COMMITTED = 10, /* there are no unconfirmed gains; the window may have expired */
    FD_RESULT_STO_ACTIVE = 11, /* the wired emergency stop is active */
    FD_RESULT_NOT_AT_REST = 12, /* an axis still moves */
};

/* Which of the two tables the board follows. */
enum fd_trajectorykind {
    FD_TRAJECTORYKIND_MULTISINE = 1, /* sum of sines in position; one component is a sinusoid */
    FD_TRAJECTORYKIND_STAIRCASE = 2, /* constant speeds, one after the other, from the rest position */
};

/* What the board does when the watchdog expires during a motion; then it is in FAULT. */
enum fd_watchdogaction {
    FD_WATCHDOGACTION_QUICK_STOP = 1, /* decelerate to rest under control */
    FD_WATCHDOGACTION_COAST = 2, /* switch the effort off */
};

#define FD_REG_IDENTITY_MAGIC 0x0000u
#define FD_REG_IDENTITY_MAP_VERSION 0x0002u
#define FD_REG_IDENTITY_FIRMWARE_VERSION 0x0003u
#define FD_REG_IDENTITY_MAP_CRC 0x0004u
#define FD_REG_IDENTITY_SERIAL_NUMBER 0x0006u
#define FD_REG_IDENTITY_FLOAT_TEST 0x0008u
#define FD_REG_IDENTITY_NONCE 0x000au
#define FD_REG_IDENTITY_SAMPLE_PERIOD 0x000cu
#define FD_REG_IDENTITY_CONTROL_DELAY 0x000eu
#define FD_REG_IDENTITY_COUNTS_PER_TURN 0x0010u
#define FD_REG_IDENTITY_EFFORT_PER_COUNT 0x0012u
#define FD_REG_STATUS_STATE 0x0040u
#define FD_REG_STATUS_FAULT_CODE 0x0041u
#define FD_REG_STATUS_FAULT_SAMPLE 0x0042u
#define FD_REG_STATUS_STO_ACTIVE 0x0044u
#define FD_REG_STATUS_LAST_TOKEN 0x0045u
#define FD_REG_STATUS_LAST_RESULT 0x0046u
#define FD_REG_STATUS_STAGED_CRC_OK 0x0047u
#define FD_REG_STATUS_UNCONFIRMED 0x0048u
#define FD_REG_STATUS_CONFIRM_REMAINING 0x0049u
#define FD_REG_STATUS_BOARD_CLOCK 0x004au
#define FD_REG_CAPTURE_PAGES_WRITTEN 0x004cu
#define FD_REG_CAPTURE_SAMPLES_CAPTURED 0x004eu
#define FD_REG_CAPTURE_OVERFLOWS 0x0050u
#define FD_REG_COMMAND_OPCODE 0x0080u
#define FD_REG_COMMAND_TOKEN 0x0081u
#define FD_REG_COMMAND_ARGUMENT 0x0082u
#define FD_REG_CAPTURE_PAGES_ACKNOWLEDGED 0x0090u
#define FD_REG_WATCHDOG_TIMEOUT 0x00a0u
#define FD_REG_WATCHDOG_ACTION 0x00a1u
#define FD_REG_TRAJECTORY_KIND 0x0100u
#define FD_REG_TRAJECTORY_LEAD_IN_SAMPLES 0x0101u
#define FD_REG_TRAJECTORY_CAPTURE_SAMPLES 0x0103u
#define FD_REG_TRAJECTORY_X_COMPONENTS 0x0110u
#define FD_REG_TRAJECTORY_X_LEVELS 0x0111u
#define FD_REG_TRAJECTORY_X_AMPLITUDE 0x0112u
#define FD_REG_TRAJECTORY_X_ANGULAR_FREQUENCY 0x0122u
#define FD_REG_TRAJECTORY_X_PHASE 0x0132u
#define FD_REG_TRAJECTORY_X_LEVEL_SPEED 0x0142u
#define FD_REG_TRAJECTORY_X_DWELL 0x015au
#define FD_REG_TRAJECTORY_X_ACCELERATION 0x015cu
#define FD_REG_TRAJECTORY_Z_COMPONENTS 0x0170u
#define FD_REG_TRAJECTORY_Z_LEVELS 0x0171u
#define FD_REG_TRAJECTORY_Z_AMPLITUDE 0x0172u
#define FD_REG_TRAJECTORY_Z_ANGULAR_FREQUENCY 0x0182u
#define FD_REG_TRAJECTORY_Z_PHASE 0x0192u
#define FD_REG_TRAJECTORY_Z_LEVEL_SPEED 0x01a2u
#define FD_REG_TRAJECTORY_Z_DWELL 0x01bau
#define FD_REG_TRAJECTORY_Z_ACCELERATION 0x01bcu
#define FD_REG_LIMITS_X_TRAVEL 0x0200u
#define FD_REG_LIMITS_X_SPEED 0x0202u
#define FD_REG_LIMITS_X_EFFORT 0x0204u
#define FD_REG_LIMITS_X_FOLLOWING_ERROR 0x0206u
#define FD_REG_LIMITS_X_GAIN_STEP 0x0208u
#define FD_REG_LIMITS_X_PROPORTIONAL 0x020au
#define FD_REG_LIMITS_X_DERIVATIVE 0x020cu
#define FD_REG_LIMITS_X_INTEGRAL 0x020eu
#define FD_REG_LIMITS_X_VELOCITY_FILTER 0x0210u
#define FD_REG_LIMITS_X_INERTIA_FEEDFORWARD 0x0212u
#define FD_REG_LIMITS_X_VISCOUS_FEEDFORWARD 0x0214u
#define FD_REG_LIMITS_X_COULOMB_FEEDFORWARD 0x0216u
#define FD_REG_LIMITS_X_COULOMB_SMOOTHING 0x0218u
#define FD_REG_LIMITS_X_OFFSET_FEEDFORWARD 0x021au
#define FD_REG_LIMITS_Z_TRAVEL 0x0220u
#define FD_REG_LIMITS_Z_SPEED 0x0222u
#define FD_REG_LIMITS_Z_EFFORT 0x0224u
#define FD_REG_LIMITS_Z_FOLLOWING_ERROR 0x0226u
#define FD_REG_LIMITS_Z_GAIN_STEP 0x0228u
#define FD_REG_LIMITS_Z_PROPORTIONAL 0x022au
#define FD_REG_LIMITS_Z_DERIVATIVE 0x022cu
#define FD_REG_LIMITS_Z_INTEGRAL 0x022eu
#define FD_REG_LIMITS_Z_VELOCITY_FILTER 0x0230u
#define FD_REG_LIMITS_Z_INERTIA_FEEDFORWARD 0x0232u
#define FD_REG_LIMITS_Z_VISCOUS_FEEDFORWARD 0x0234u
#define FD_REG_LIMITS_Z_COULOMB_FEEDFORWARD 0x0236u
#define FD_REG_LIMITS_Z_COULOMB_SMOOTHING 0x0238u
#define FD_REG_LIMITS_Z_OFFSET_FEEDFORWARD 0x023au
#define FD_REG_ACTIVE_X_PROPORTIONAL 0x0300u
#define FD_REG_ACTIVE_X_DERIVATIVE 0x0302u
#define FD_REG_ACTIVE_X_INTEGRAL 0x0304u
#define FD_REG_ACTIVE_X_VELOCITY_FILTER 0x0306u
#define FD_REG_ACTIVE_X_INERTIA_FEEDFORWARD 0x0308u
#define FD_REG_ACTIVE_X_VISCOUS_FEEDFORWARD 0x030au
#define FD_REG_ACTIVE_X_COULOMB_FEEDFORWARD 0x030cu
#define FD_REG_ACTIVE_X_COULOMB_SMOOTHING 0x030eu
#define FD_REG_ACTIVE_X_OFFSET_FEEDFORWARD 0x0310u
#define FD_REG_ACTIVE_Z_PROPORTIONAL 0x0312u
#define FD_REG_ACTIVE_Z_DERIVATIVE 0x0314u
#define FD_REG_ACTIVE_Z_INTEGRAL 0x0316u
#define FD_REG_ACTIVE_Z_VELOCITY_FILTER 0x0318u
#define FD_REG_ACTIVE_Z_INERTIA_FEEDFORWARD 0x031au
#define FD_REG_ACTIVE_Z_VISCOUS_FEEDFORWARD 0x031cu
#define FD_REG_ACTIVE_Z_COULOMB_FEEDFORWARD 0x031eu
#define FD_REG_ACTIVE_Z_COULOMB_SMOOTHING 0x0320u
#define FD_REG_ACTIVE_Z_OFFSET_FEEDFORWARD 0x0322u
#define FD_REG_SHADOW_X_PROPORTIONAL 0x0340u
#define FD_REG_SHADOW_X_DERIVATIVE 0x0342u
#define FD_REG_SHADOW_X_INTEGRAL 0x0344u
#define FD_REG_SHADOW_X_VELOCITY_FILTER 0x0346u
#define FD_REG_SHADOW_X_INERTIA_FEEDFORWARD 0x0348u
#define FD_REG_SHADOW_X_VISCOUS_FEEDFORWARD 0x034au
#define FD_REG_SHADOW_X_COULOMB_FEEDFORWARD 0x034cu
#define FD_REG_SHADOW_X_COULOMB_SMOOTHING 0x034eu
#define FD_REG_SHADOW_X_OFFSET_FEEDFORWARD 0x0350u
#define FD_REG_SHADOW_Z_PROPORTIONAL 0x0352u
#define FD_REG_SHADOW_Z_DERIVATIVE 0x0354u
#define FD_REG_SHADOW_Z_INTEGRAL 0x0356u
#define FD_REG_SHADOW_Z_VELOCITY_FILTER 0x0358u
#define FD_REG_SHADOW_Z_INERTIA_FEEDFORWARD 0x035au
#define FD_REG_SHADOW_Z_VISCOUS_FEEDFORWARD 0x035cu
#define FD_REG_SHADOW_Z_COULOMB_FEEDFORWARD 0x035eu
#define FD_REG_SHADOW_Z_COULOMB_SMOOTHING 0x0360u
#define FD_REG_SHADOW_Z_OFFSET_FEEDFORWARD 0x0362u
#define FD_REG_SHADOW_CRC 0x0364u

/* One axis of a gain bank. */
struct fd_gain_bank {
    float proportional;
    float derivative;
    float integral;
    float velocity_filter;
    float inertia_feedforward;
    float viscous_feedforward;
    float coulomb_feedforward;
    float coulomb_smoothing;
    float offset_feedforward;
};
_Static_assert(offsetof(struct fd_gain_bank, proportional) == 0u, "layout");
_Static_assert(offsetof(struct fd_gain_bank, derivative) == 4u, "layout");
_Static_assert(offsetof(struct fd_gain_bank, integral) == 8u, "layout");
_Static_assert(offsetof(struct fd_gain_bank, velocity_filter) == 12u, "layout");
_Static_assert(offsetof(struct fd_gain_bank, inertia_feedforward) == 16u, "layout");
_Static_assert(offsetof(struct fd_gain_bank, viscous_feedforward) == 20u, "layout");
_Static_assert(offsetof(struct fd_gain_bank, coulomb_feedforward) == 24u, "layout");
_Static_assert(offsetof(struct fd_gain_bank, coulomb_smoothing) == 28u, "layout");
_Static_assert(offsetof(struct fd_gain_bank, offset_feedforward) == 32u, "layout");
_Static_assert(sizeof(struct fd_gain_bank) == 36u, "layout");

/* A capture page as words on the wire, high word first; short pages are zero-padded. */
struct fd_page {
    uint16_t index[2];
    uint16_t first_sample[2];
    uint16_t count;
    struct {
        uint16_t position[2]; /* int32_t counts */
        uint16_t effort; /* int16_t counts */
        uint16_t following_error; /* int16_t counts, saturating */
    } sample[FD_PAGE_SAMPLES][FD_AXES];
    uint16_t crc[2]; /* CRC-32 of the words before, big-endian */
};
_Static_assert(sizeof(struct fd_page) == 2u * FD_PAGE_WORDS, "layout");
_Static_assert(FD_PAGE_WORDS <= FD_PAGE_SLOT_REGISTERS, "a page fits its slot");
_Static_assert(FD_PAGE_WORDS <= 125u, "a page fits one Modbus read");

#endif
