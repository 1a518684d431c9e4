/* The register map. Generated from registers.toml by firmware_interface/generate.py; do not edit. */
#ifndef FEED_DRIVE_REGISTERS_H
#define FEED_DRIVE_REGISTERS_H

#include <stddef.h>
#include <stdint.h>

#define FD_MAGIC 0x4d464453u
#define FD_MAP_VERSION 6u
#define FD_MAP_CRC 0xaae95dbbu
#define FD_FLOAT_TEST 3.1415927f
#define FD_STORE_SIGNATURE 0x65766173u
#define FD_SESSION_LEASE_S 5.0f
#define FD_AXES 2u
#define FD_PAGE_ADDRESS 0x1000u
#define FD_PAGE_SLOTS 256u
#define FD_PAGE_SLOT_REGISTERS 128u
#define FD_PAGE_SAMPLES 14u
#define FD_PAGE_WORDS 119u

/* State of the board. */
enum fd_state {
    FD_STATE_INIT = 0, /* self-test after power-up */
    FD_STATE_IDLE = 1, /* at rest, takes commands; holds its position if enabled, otherwise without effort */
    FD_STATE_ARMED = 2, /* the trajectory is checked, START may follow */
    FD_STATE_MOVING = 3, /* lead-in and captured motion */
    FD_STATE_DRAINING = 4, /* capture is complete: comes to rest, pages still to be fetched */
    FD_STATE_DONE = 5, /* at rest, every page acknowledged */
    FD_STATE_FAULT = 6, /* latched until CLEAR_FAULT, effort off */
    FD_STATE_STOPPING = 7, /* decelerates to rest */
    FD_STATE_CHECKING = 8, /* ARM walks through the trajectory; the axes hold their position */
};

/* Why the board is in FAULT. */
enum fd_fault {
    FD_FAULT_NONE = 0, /* no fault */
    FD_FAULT_SELF_TEST = 1, /* the self-test after power-up failed */
    FD_FAULT_TRAVEL = 2, /* an axis left its travel range */
    FD_FAULT_SPEED = 3, /* an axis was faster than its speed limit */
    FD_FAULT_FOLLOWING_ERROR = 4, /* an axis fell too far behind its reference */
    FD_FAULT_WATCHDOG = 5, /* the host that started the motion fell silent */
    FD_FAULT_STO = 6, /* the wired emergency stop cut the effort */
    FD_FAULT_NOT_FINITE = 7, /* a setpoint or an effort was not a finite number */
    FD_FAULT_LIMIT_SWITCH = 8, /* an axis moved onto a limit switch */
    FD_FAULT_OSCILLATION = 9, /* the feedback kept an axis swinging to and fro */
    FD_FAULT_STOP_OVERDUE = 10, /* an axis did not come to rest in the time of a stop, so the effort was cut */
};

/* Commands; each is written with a fresh token and its argument in one write. */
enum fd_opcode {
    FD_OPCODE_ARM = 1, /* check the trajectory from the present position on; argument: CRC-32 of the trajectory's words */
    FD_OPCODE_START = 2, /* start the armed motion; argument: the map CRC */
    FD_OPCODE_QUICK_STOP = 3, /* decelerate to rest, and end the hold of another host; no safety function */
    FD_OPCODE_FINISH = 4, /* leave DONE for IDLE */
    FD_OPCODE_CLEAR_FAULT = 5, /* leave FAULT for IDLE, at rest only; the effort stays off */
    FD_OPCODE_COMMIT = 6, /* swap the shadow bank into the active one where the axes stand, keep the old one; argument: CRC of the shadow bank */
    FD_OPCODE_CONFIRM = 7, /* keep the committed gains */
    FD_OPCODE_ROLL_BACK = 8, /* return to the gains before the last COMMIT, at rest; where an axis moves in IDLE, begin a stop, as DISABLE does */
    FD_OPCODE_STORE = 9, /* write confirmed gains to permanent memory; argument: 0x65766173 */
    FD_OPCODE_ENABLE = 10, /* let the control law act and release the brake, where the axes stand */
    FD_OPCODE_DISABLE = 11, /* apply the brake and switch the effort off, at rest; where an axis moves in IDLE, ARMED or DONE, begin a stop, whose end is never later than its time */
    FD_OPCODE_COMMIT_RUNNING = 12, /* COMMIT while the control law acts: in IDLE and DONE, or in DRAINING while the axes come to rest; the effort goes on without a jump */
};

/* What became of the last command. */
enum fd_result {
    FD_RESULT_NONE = 0, /* no command yet */
    FD_RESULT_DONE = 1, /* carried out */
    FD_RESULT_UNKNOWN_COMMAND = 2, /* the board does not know this command */
    FD_RESULT_WRONG_STATE = 3, /* not allowed in the board's present state */
    FD_RESULT_WRONG_ARGUMENT = 4, /* the argument is not the expected signature */
    FD_RESULT_BAD_TRAJECTORY = 5, /* the trajectory is incomplete, not finite, faster than the sampling, or not the one that the host wrote */
    FD_RESULT_TRAJECTORY_LIMITS = 6, /* the trajectory would leave the limits of travel, speed, acceleration or effort */
    FD_RESULT_GAIN_CRC = 7, /* the shadow bank does not match its CRC, or is not the one that the host staged */
    FD_RESULT_GAIN_LIMITS = 8, /* a staged gain is outside the board's limits or changes too much at once */
    FD_RESULT_UNCONFIRMED = 9, /* gains committed before are not confirmed yet */
    FD_RESULT_NOTHING_COMMITTED = 10, /* there are no unconfirmed gains; the window may have expired */
    FD_RESULT_STO_ACTIVE = 11, /* the wired emergency stop is active */
    FD_RESULT_NOT_AT_REST = 12, /* an axis still moves */
    FD_RESULT_STORE_FAILED = 13, /* permanent memory did not take the gains */
    FD_RESULT_PENDING = 14, /* still being carried out */
    FD_RESULT_NOT_ENABLED = 15, /* the effort is off */
    FD_RESULT_NOT_HELD = 16, /* the command came from a host that does not control the board */
    FD_RESULT_EFFORT_JUMP = 17, /* the effort would jump too far under the staged gains; the old ones stay in force */
    FD_RESULT_UNSTABLE_FEEDBACK = 18, /* with the inertia and friction that the board states, the loop would be unstable under the staged gains */
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

/* What the board's own identification does; only a board that has a network identifies. */
enum fd_identificationstate {
    FD_IDENTIFICATIONSTATE_NONE = 0, /* no motion was captured since power-up */
    FD_IDENTIFICATIONSTATE_CAPTURING = 1, /* from START to the last captured sample */
    FD_IDENTIFICATIONSTATE_RUNNING = 2, /* computes, beside everything else that the board does */
    FD_IDENTIFICATIONSTATE_DONE = 3, /* an axis without a reason is identified */
    FD_IDENTIFICATIONSTATE_FAILED = 4, /* no axis is identified; their reasons say why */
};

/* Why the board did not identify an axis. */
enum fd_identificationreason {
    FD_IDENTIFICATIONREASON_NONE = 0, /* it is identified, or not yet */
    FD_IDENTIFICATIONREASON_STOPPED = 1, /* the motion was stopped before the end of its capture */
    FD_IDENTIFICATIONREASON_TOO_SHORT = 2, /* the capture is shorter than the motion that the network was trained for */
    FD_IDENTIFICATIONREASON_STANDSTILL = 3, /* the axis stood still */
    FD_IDENTIFICATIONREASON_OTHER_MOTION = 4, /* the axis moved otherwise than the network was trained for */
    FD_IDENTIFICATIONREASON_NO_EFFORT = 5, /* the effort was below one PWM count */
    FD_IDENTIFICATIONREASON_UNEXPLAINED = 6, /* the parameters found leave more than 15 % of the effort */
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
#define FD_REG_STATUS_ENABLED 0x0052u
#define FD_REG_STATUS_HOMED 0x0053u
#define FD_REG_STATUS_LIMIT_SWITCHES 0x0054u
#define FD_REG_STATUS_BRAKE_RELEASED 0x0055u
#define FD_REG_STATUS_STO_LATCHED 0x0056u
#define FD_REG_STATUS_SAMPLES_TO_CHECK 0x0057u
#define FD_REG_STATUS_STORES 0x0059u
#define FD_REG_SESSION_REMAINING 0x005bu
#define FD_REG_MEASURED_X_POSITION 0x005cu
#define FD_REG_MEASURED_X_SPEED 0x005eu
#define FD_REG_MEASURED_Z_POSITION 0x0060u
#define FD_REG_MEASURED_Z_SPEED 0x0062u
#define FD_REG_COMMAND_OPCODE 0x0080u
#define FD_REG_COMMAND_TOKEN 0x0081u
#define FD_REG_COMMAND_ARGUMENT 0x0082u
#define FD_REG_COMMAND_KEY 0x0084u
#define FD_REG_SESSION_RELEASE 0x008eu
#define FD_REG_SESSION_KEY 0x0090u
#define FD_REG_CAPTURE_PAGES_ACKNOWLEDGED 0x0092u
#define FD_REG_WATCHDOG_TIMEOUT 0x00a0u
#define FD_REG_WATCHDOG_ACTION 0x00a1u
#define FD_REG_BUMPLESS_CAPABLE 0x00c0u
#define FD_REG_BUMPLESS_X_JUMP_LIMIT 0x00c2u
#define FD_REG_BUMPLESS_X_JUMP 0x00c4u
#define FD_REG_BUMPLESS_Z_JUMP_LIMIT 0x00c6u
#define FD_REG_BUMPLESS_Z_JUMP 0x00c8u
#define FD_REG_STATED_X_INERTIA 0x00ccu
#define FD_REG_STATED_X_VISCOUS_FRICTION 0x00ceu
#define FD_REG_STATED_Z_INERTIA 0x00d0u
#define FD_REG_STATED_Z_VISCOUS_FRICTION 0x00d2u
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
#define FD_REG_LIMITS_X_ACCELERATION 0x020au
#define FD_REG_GAIN_MAXIMUM_X_PROPORTIONAL 0x020cu
#define FD_REG_GAIN_MAXIMUM_X_DERIVATIVE 0x020eu
#define FD_REG_GAIN_MAXIMUM_X_INTEGRAL 0x0210u
#define FD_REG_GAIN_MAXIMUM_X_VELOCITY_FILTER 0x0212u
#define FD_REG_GAIN_MAXIMUM_X_INERTIA_FEEDFORWARD 0x0214u
#define FD_REG_GAIN_MAXIMUM_X_VISCOUS_FEEDFORWARD 0x0216u
#define FD_REG_GAIN_MAXIMUM_X_COULOMB_FEEDFORWARD 0x0218u
#define FD_REG_GAIN_MAXIMUM_X_COULOMB_SMOOTHING 0x021au
#define FD_REG_GAIN_MAXIMUM_X_OFFSET_FEEDFORWARD 0x021cu
#define FD_REG_GAIN_MAXIMUM_X_STRIBECK_FEEDFORWARD 0x021eu
#define FD_REG_GAIN_MAXIMUM_X_STRIBECK_SPEED 0x0220u
#define FD_REG_GAIN_MAXIMUM_X_VISCOUS_DIFFERENCE_FEEDFORWARD 0x0222u
#define FD_REG_GAIN_MAXIMUM_X_RIPPLE_COSINE 0x0224u
#define FD_REG_GAIN_MAXIMUM_X_RIPPLE_SINE 0x022cu
#define FD_REG_GAIN_MAXIMUM_X_RIPPLE_PERIOD 0x0234u
#define FD_REG_LIMITS_Z_TRAVEL 0x0240u
#define FD_REG_LIMITS_Z_SPEED 0x0242u
#define FD_REG_LIMITS_Z_EFFORT 0x0244u
#define FD_REG_LIMITS_Z_FOLLOWING_ERROR 0x0246u
#define FD_REG_LIMITS_Z_GAIN_STEP 0x0248u
#define FD_REG_LIMITS_Z_ACCELERATION 0x024au
#define FD_REG_GAIN_MAXIMUM_Z_PROPORTIONAL 0x024cu
#define FD_REG_GAIN_MAXIMUM_Z_DERIVATIVE 0x024eu
#define FD_REG_GAIN_MAXIMUM_Z_INTEGRAL 0x0250u
#define FD_REG_GAIN_MAXIMUM_Z_VELOCITY_FILTER 0x0252u
#define FD_REG_GAIN_MAXIMUM_Z_INERTIA_FEEDFORWARD 0x0254u
#define FD_REG_GAIN_MAXIMUM_Z_VISCOUS_FEEDFORWARD 0x0256u
#define FD_REG_GAIN_MAXIMUM_Z_COULOMB_FEEDFORWARD 0x0258u
#define FD_REG_GAIN_MAXIMUM_Z_COULOMB_SMOOTHING 0x025au
#define FD_REG_GAIN_MAXIMUM_Z_OFFSET_FEEDFORWARD 0x025cu
#define FD_REG_GAIN_MAXIMUM_Z_STRIBECK_FEEDFORWARD 0x025eu
#define FD_REG_GAIN_MAXIMUM_Z_STRIBECK_SPEED 0x0260u
#define FD_REG_GAIN_MAXIMUM_Z_VISCOUS_DIFFERENCE_FEEDFORWARD 0x0262u
#define FD_REG_GAIN_MAXIMUM_Z_RIPPLE_COSINE 0x0264u
#define FD_REG_GAIN_MAXIMUM_Z_RIPPLE_SINE 0x026cu
#define FD_REG_GAIN_MAXIMUM_Z_RIPPLE_PERIOD 0x0274u
#define FD_REG_ACTIVE_X_PROPORTIONAL 0x0300u
#define FD_REG_ACTIVE_X_DERIVATIVE 0x0302u
#define FD_REG_ACTIVE_X_INTEGRAL 0x0304u
#define FD_REG_ACTIVE_X_VELOCITY_FILTER 0x0306u
#define FD_REG_ACTIVE_X_INERTIA_FEEDFORWARD 0x0308u
#define FD_REG_ACTIVE_X_VISCOUS_FEEDFORWARD 0x030au
#define FD_REG_ACTIVE_X_COULOMB_FEEDFORWARD 0x030cu
#define FD_REG_ACTIVE_X_COULOMB_SMOOTHING 0x030eu
#define FD_REG_ACTIVE_X_OFFSET_FEEDFORWARD 0x0310u
#define FD_REG_ACTIVE_X_STRIBECK_FEEDFORWARD 0x0312u
#define FD_REG_ACTIVE_X_STRIBECK_SPEED 0x0314u
#define FD_REG_ACTIVE_X_VISCOUS_DIFFERENCE_FEEDFORWARD 0x0316u
#define FD_REG_ACTIVE_X_RIPPLE_COSINE 0x0318u
#define FD_REG_ACTIVE_X_RIPPLE_SINE 0x0320u
#define FD_REG_ACTIVE_X_RIPPLE_PERIOD 0x0328u
#define FD_REG_ACTIVE_Z_PROPORTIONAL 0x0330u
#define FD_REG_ACTIVE_Z_DERIVATIVE 0x0332u
#define FD_REG_ACTIVE_Z_INTEGRAL 0x0334u
#define FD_REG_ACTIVE_Z_VELOCITY_FILTER 0x0336u
#define FD_REG_ACTIVE_Z_INERTIA_FEEDFORWARD 0x0338u
#define FD_REG_ACTIVE_Z_VISCOUS_FEEDFORWARD 0x033au
#define FD_REG_ACTIVE_Z_COULOMB_FEEDFORWARD 0x033cu
#define FD_REG_ACTIVE_Z_COULOMB_SMOOTHING 0x033eu
#define FD_REG_ACTIVE_Z_OFFSET_FEEDFORWARD 0x0340u
#define FD_REG_ACTIVE_Z_STRIBECK_FEEDFORWARD 0x0342u
#define FD_REG_ACTIVE_Z_STRIBECK_SPEED 0x0344u
#define FD_REG_ACTIVE_Z_VISCOUS_DIFFERENCE_FEEDFORWARD 0x0346u
#define FD_REG_ACTIVE_Z_RIPPLE_COSINE 0x0348u
#define FD_REG_ACTIVE_Z_RIPPLE_SINE 0x0350u
#define FD_REG_ACTIVE_Z_RIPPLE_PERIOD 0x0358u
#define FD_REG_SHADOW_X_PROPORTIONAL 0x0380u
#define FD_REG_SHADOW_X_DERIVATIVE 0x0382u
#define FD_REG_SHADOW_X_INTEGRAL 0x0384u
#define FD_REG_SHADOW_X_VELOCITY_FILTER 0x0386u
#define FD_REG_SHADOW_X_INERTIA_FEEDFORWARD 0x0388u
#define FD_REG_SHADOW_X_VISCOUS_FEEDFORWARD 0x038au
#define FD_REG_SHADOW_X_COULOMB_FEEDFORWARD 0x038cu
#define FD_REG_SHADOW_X_COULOMB_SMOOTHING 0x038eu
#define FD_REG_SHADOW_X_OFFSET_FEEDFORWARD 0x0390u
#define FD_REG_SHADOW_X_STRIBECK_FEEDFORWARD 0x0392u
#define FD_REG_SHADOW_X_STRIBECK_SPEED 0x0394u
#define FD_REG_SHADOW_X_VISCOUS_DIFFERENCE_FEEDFORWARD 0x0396u
#define FD_REG_SHADOW_X_RIPPLE_COSINE 0x0398u
#define FD_REG_SHADOW_X_RIPPLE_SINE 0x03a0u
#define FD_REG_SHADOW_X_RIPPLE_PERIOD 0x03a8u
#define FD_REG_SHADOW_Z_PROPORTIONAL 0x03b0u
#define FD_REG_SHADOW_Z_DERIVATIVE 0x03b2u
#define FD_REG_SHADOW_Z_INTEGRAL 0x03b4u
#define FD_REG_SHADOW_Z_VELOCITY_FILTER 0x03b6u
#define FD_REG_SHADOW_Z_INERTIA_FEEDFORWARD 0x03b8u
#define FD_REG_SHADOW_Z_VISCOUS_FEEDFORWARD 0x03bau
#define FD_REG_SHADOW_Z_COULOMB_FEEDFORWARD 0x03bcu
#define FD_REG_SHADOW_Z_COULOMB_SMOOTHING 0x03beu
#define FD_REG_SHADOW_Z_OFFSET_FEEDFORWARD 0x03c0u
#define FD_REG_SHADOW_Z_STRIBECK_FEEDFORWARD 0x03c2u
#define FD_REG_SHADOW_Z_STRIBECK_SPEED 0x03c4u
#define FD_REG_SHADOW_Z_VISCOUS_DIFFERENCE_FEEDFORWARD 0x03c6u
#define FD_REG_SHADOW_Z_RIPPLE_COSINE 0x03c8u
#define FD_REG_SHADOW_Z_RIPPLE_SINE 0x03d0u
#define FD_REG_SHADOW_Z_RIPPLE_PERIOD 0x03d8u
#define FD_REG_SHADOW_CRC 0x03e0u
#define FD_REG_ACTIVE_X_FRICTION_TOP_SPEED 0x0400u
#define FD_REG_ACTIVE_X_FRICTION_FORWARD 0x0402u
#define FD_REG_ACTIVE_X_FRICTION_BACKWARD 0x041au
#define FD_REG_ACTIVE_X_TABLE_START 0x0432u
#define FD_REG_ACTIVE_X_TABLE_STEP 0x0434u
#define FD_REG_ACTIVE_X_LOAD_TABLE 0x0436u
#define FD_REG_ACTIVE_X_LOCAL_FRICTION_TABLE 0x0466u
#define FD_REG_ACTIVE_X_TABLE_FADE_SPEED 0x0496u
#define FD_REG_ACTIVE_X_RIPPLE_FADE_SPEED 0x0498u
#define FD_REG_ACTIVE_X_PRESLIDING_FEEDFORWARD 0x04a0u
#define FD_REG_ACTIVE_X_PRESLIDING_DISTANCE 0x04a2u
#define FD_REG_ACTIVE_X_BACKLASH_OFFSET 0x04a4u
#define FD_REG_ACTIVE_X_BACKLASH_DISTANCE 0x04a6u
#define FD_REG_ACTIVE_X_DEADBAND_INVERSE 0x04a8u
#define FD_REG_ACTIVE_X_DEADBAND_SMOOTHING 0x04aau
#define FD_REG_ACTIVE_X_CROSS_INERTIA_FEEDFORWARD 0x04acu
#define FD_REG_ACTIVE_X_CROSS_VISCOUS_FEEDFORWARD 0x04aeu
#define FD_REG_ACTIVE_X_CROSS_COULOMB_FEEDFORWARD 0x04b0u
#define FD_REG_ACTIVE_X_TRANSMISSION_LOSS 0x04b2u
#define FD_REG_ACTIVE_X_TRANSMITTED_INERTIA 0x04b4u
#define FD_REG_ACTIVE_X_TRANSMITTED_FRICTION 0x04b6u
#define FD_REG_ACTIVE_Z_FRICTION_TOP_SPEED 0x04b8u
#define FD_REG_ACTIVE_Z_FRICTION_FORWARD 0x04bau
#define FD_REG_ACTIVE_Z_FRICTION_BACKWARD 0x04d2u
#define FD_REG_ACTIVE_Z_TABLE_START 0x04eau
#define FD_REG_ACTIVE_Z_TABLE_STEP 0x04ecu
#define FD_REG_ACTIVE_Z_LOAD_TABLE 0x04eeu
#define FD_REG_ACTIVE_Z_LOCAL_FRICTION_TABLE 0x051eu
#define FD_REG_ACTIVE_Z_TABLE_FADE_SPEED 0x054eu
#define FD_REG_ACTIVE_Z_RIPPLE_FADE_SPEED 0x0550u
#define FD_REG_ACTIVE_Z_PRESLIDING_FEEDFORWARD 0x0558u
#define FD_REG_ACTIVE_Z_PRESLIDING_DISTANCE 0x055au
#define FD_REG_ACTIVE_Z_BACKLASH_OFFSET 0x055cu
#define FD_REG_ACTIVE_Z_BACKLASH_DISTANCE 0x055eu
#define FD_REG_ACTIVE_Z_DEADBAND_INVERSE 0x0560u
#define FD_REG_ACTIVE_Z_DEADBAND_SMOOTHING 0x0562u
#define FD_REG_ACTIVE_Z_CROSS_INERTIA_FEEDFORWARD 0x0564u
#define FD_REG_ACTIVE_Z_CROSS_VISCOUS_FEEDFORWARD 0x0566u
#define FD_REG_ACTIVE_Z_CROSS_COULOMB_FEEDFORWARD 0x0568u
#define FD_REG_ACTIVE_Z_TRANSMISSION_LOSS 0x056au
#define FD_REG_ACTIVE_Z_TRANSMITTED_INERTIA 0x056cu
#define FD_REG_ACTIVE_Z_TRANSMITTED_FRICTION 0x056eu
#define FD_REG_ACTIVE_CRC 0x0570u
#define FD_REG_SHADOW_X_FRICTION_TOP_SPEED 0x0580u
#define FD_REG_SHADOW_X_FRICTION_FORWARD 0x0582u
#define FD_REG_SHADOW_X_FRICTION_BACKWARD 0x059au
#define FD_REG_SHADOW_X_TABLE_START 0x05b2u
#define FD_REG_SHADOW_X_TABLE_STEP 0x05b4u
#define FD_REG_SHADOW_X_LOAD_TABLE 0x05b6u
#define FD_REG_SHADOW_X_LOCAL_FRICTION_TABLE 0x05e6u
#define FD_REG_SHADOW_X_TABLE_FADE_SPEED 0x0616u
#define FD_REG_SHADOW_X_RIPPLE_FADE_SPEED 0x0618u
#define FD_REG_SHADOW_X_PRESLIDING_FEEDFORWARD 0x0620u
#define FD_REG_SHADOW_X_PRESLIDING_DISTANCE 0x0622u
#define FD_REG_SHADOW_X_BACKLASH_OFFSET 0x0624u
#define FD_REG_SHADOW_X_BACKLASH_DISTANCE 0x0626u
#define FD_REG_SHADOW_X_DEADBAND_INVERSE 0x0628u
#define FD_REG_SHADOW_X_DEADBAND_SMOOTHING 0x062au
#define FD_REG_SHADOW_X_CROSS_INERTIA_FEEDFORWARD 0x062cu
#define FD_REG_SHADOW_X_CROSS_VISCOUS_FEEDFORWARD 0x062eu
#define FD_REG_SHADOW_X_CROSS_COULOMB_FEEDFORWARD 0x0630u
#define FD_REG_SHADOW_X_TRANSMISSION_LOSS 0x0632u
#define FD_REG_SHADOW_X_TRANSMITTED_INERTIA 0x0634u
#define FD_REG_SHADOW_X_TRANSMITTED_FRICTION 0x0636u
#define FD_REG_SHADOW_Z_FRICTION_TOP_SPEED 0x0638u
#define FD_REG_SHADOW_Z_FRICTION_FORWARD 0x063au
#define FD_REG_SHADOW_Z_FRICTION_BACKWARD 0x0652u
#define FD_REG_SHADOW_Z_TABLE_START 0x066au
#define FD_REG_SHADOW_Z_TABLE_STEP 0x066cu
#define FD_REG_SHADOW_Z_LOAD_TABLE 0x066eu
#define FD_REG_SHADOW_Z_LOCAL_FRICTION_TABLE 0x069eu
#define FD_REG_SHADOW_Z_TABLE_FADE_SPEED 0x06ceu
#define FD_REG_SHADOW_Z_RIPPLE_FADE_SPEED 0x06d0u
#define FD_REG_SHADOW_Z_PRESLIDING_FEEDFORWARD 0x06d8u
#define FD_REG_SHADOW_Z_PRESLIDING_DISTANCE 0x06dau
#define FD_REG_SHADOW_Z_BACKLASH_OFFSET 0x06dcu
#define FD_REG_SHADOW_Z_BACKLASH_DISTANCE 0x06deu
#define FD_REG_SHADOW_Z_DEADBAND_INVERSE 0x06e0u
#define FD_REG_SHADOW_Z_DEADBAND_SMOOTHING 0x06e2u
#define FD_REG_SHADOW_Z_CROSS_INERTIA_FEEDFORWARD 0x06e4u
#define FD_REG_SHADOW_Z_CROSS_VISCOUS_FEEDFORWARD 0x06e6u
#define FD_REG_SHADOW_Z_CROSS_COULOMB_FEEDFORWARD 0x06e8u
#define FD_REG_SHADOW_Z_TRANSMISSION_LOSS 0x06eau
#define FD_REG_SHADOW_Z_TRANSMITTED_INERTIA 0x06ecu
#define FD_REG_SHADOW_Z_TRANSMITTED_FRICTION 0x06eeu
#define FD_REG_GAIN_MAXIMUM_X_FRICTION_TOP_SPEED 0x0700u
#define FD_REG_GAIN_MAXIMUM_X_FRICTION_FORWARD 0x0702u
#define FD_REG_GAIN_MAXIMUM_X_FRICTION_BACKWARD 0x071au
#define FD_REG_GAIN_MAXIMUM_X_TABLE_START 0x0732u
#define FD_REG_GAIN_MAXIMUM_X_TABLE_STEP 0x0734u
#define FD_REG_GAIN_MAXIMUM_X_LOAD_TABLE 0x0736u
#define FD_REG_GAIN_MAXIMUM_X_LOCAL_FRICTION_TABLE 0x0766u
#define FD_REG_GAIN_MAXIMUM_X_TABLE_FADE_SPEED 0x0796u
#define FD_REG_GAIN_MAXIMUM_X_RIPPLE_FADE_SPEED 0x0798u
#define FD_REG_GAIN_MAXIMUM_X_PRESLIDING_FEEDFORWARD 0x07a0u
#define FD_REG_GAIN_MAXIMUM_X_PRESLIDING_DISTANCE 0x07a2u
#define FD_REG_GAIN_MAXIMUM_X_BACKLASH_OFFSET 0x07a4u
#define FD_REG_GAIN_MAXIMUM_X_BACKLASH_DISTANCE 0x07a6u
#define FD_REG_GAIN_MAXIMUM_X_DEADBAND_INVERSE 0x07a8u
#define FD_REG_GAIN_MAXIMUM_X_DEADBAND_SMOOTHING 0x07aau
#define FD_REG_GAIN_MAXIMUM_X_CROSS_INERTIA_FEEDFORWARD 0x07acu
#define FD_REG_GAIN_MAXIMUM_X_CROSS_VISCOUS_FEEDFORWARD 0x07aeu
#define FD_REG_GAIN_MAXIMUM_X_CROSS_COULOMB_FEEDFORWARD 0x07b0u
#define FD_REG_GAIN_MAXIMUM_X_TRANSMISSION_LOSS 0x07b2u
#define FD_REG_GAIN_MAXIMUM_X_TRANSMITTED_INERTIA 0x07b4u
#define FD_REG_GAIN_MAXIMUM_X_TRANSMITTED_FRICTION 0x07b6u
#define FD_REG_GAIN_MAXIMUM_Z_FRICTION_TOP_SPEED 0x07b8u
#define FD_REG_GAIN_MAXIMUM_Z_FRICTION_FORWARD 0x07bau
#define FD_REG_GAIN_MAXIMUM_Z_FRICTION_BACKWARD 0x07d2u
#define FD_REG_GAIN_MAXIMUM_Z_TABLE_START 0x07eau
#define FD_REG_GAIN_MAXIMUM_Z_TABLE_STEP 0x07ecu
#define FD_REG_GAIN_MAXIMUM_Z_LOAD_TABLE 0x07eeu
#define FD_REG_GAIN_MAXIMUM_Z_LOCAL_FRICTION_TABLE 0x081eu
#define FD_REG_GAIN_MAXIMUM_Z_TABLE_FADE_SPEED 0x084eu
#define FD_REG_GAIN_MAXIMUM_Z_RIPPLE_FADE_SPEED 0x0850u
#define FD_REG_GAIN_MAXIMUM_Z_PRESLIDING_FEEDFORWARD 0x0858u
#define FD_REG_GAIN_MAXIMUM_Z_PRESLIDING_DISTANCE 0x085au
#define FD_REG_GAIN_MAXIMUM_Z_BACKLASH_OFFSET 0x085cu
#define FD_REG_GAIN_MAXIMUM_Z_BACKLASH_DISTANCE 0x085eu
#define FD_REG_GAIN_MAXIMUM_Z_DEADBAND_INVERSE 0x0860u
#define FD_REG_GAIN_MAXIMUM_Z_DEADBAND_SMOOTHING 0x0862u
#define FD_REG_GAIN_MAXIMUM_Z_CROSS_INERTIA_FEEDFORWARD 0x0864u
#define FD_REG_GAIN_MAXIMUM_Z_CROSS_VISCOUS_FEEDFORWARD 0x0866u
#define FD_REG_GAIN_MAXIMUM_Z_CROSS_COULOMB_FEEDFORWARD 0x0868u
#define FD_REG_GAIN_MAXIMUM_Z_TRANSMISSION_LOSS 0x086au
#define FD_REG_GAIN_MAXIMUM_Z_TRANSMITTED_INERTIA 0x086cu
#define FD_REG_GAIN_MAXIMUM_Z_TRANSMITTED_FRICTION 0x086eu
#define FD_REG_IDENTIFICATION_STATE 0x0900u
#define FD_REG_IDENTIFICATION_MOTION 0x0901u
#define FD_REG_IDENTIFICATION_NETWORK 0x0902u
#define FD_REG_IDENTIFICATION_X_REASON 0x0904u
#define FD_REG_IDENTIFICATION_X_IMAGES 0x0905u
#define FD_REG_IDENTIFICATION_X_INERTIA 0x0906u
#define FD_REG_IDENTIFICATION_X_VISCOUS_FRICTION 0x0908u
#define FD_REG_IDENTIFICATION_X_COULOMB_FRICTION 0x090au
#define FD_REG_IDENTIFICATION_X_OFFSET 0x090cu
#define FD_REG_IDENTIFICATION_X_RELATIVE_RESIDUAL 0x090eu
#define FD_REG_IDENTIFICATION_Z_REASON 0x0910u
#define FD_REG_IDENTIFICATION_Z_IMAGES 0x0911u
#define FD_REG_IDENTIFICATION_Z_INERTIA 0x0912u
#define FD_REG_IDENTIFICATION_Z_VISCOUS_FRICTION 0x0914u
#define FD_REG_IDENTIFICATION_Z_COULOMB_FRICTION 0x0916u
#define FD_REG_IDENTIFICATION_Z_OFFSET 0x0918u
#define FD_REG_IDENTIFICATION_Z_RELATIVE_RESIDUAL 0x091au
#define FD_REG_IDENTIFICATION_CRC 0x091cu
#define FD_REG_END 0x091eu

/* Every register, by address: FD_REGISTERS(X) expands to
 * X(address, words of a value, values, writable, smallest, largest raw value). */
#define FD_REGISTERS(X) \
    X(0x0000u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0002u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0003u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0004u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0006u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0008u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x000au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x000cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x000eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0010u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0012u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0040u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0041u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0042u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0044u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0045u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0046u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0047u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0048u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0049u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x004au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x004cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x004eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0050u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0052u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0053u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0054u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0055u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0056u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0057u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0059u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x005bu, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x005cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x005eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0060u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0062u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0080u, 1u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0081u, 1u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0082u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0084u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x008eu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0090u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0092u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x00a0u, 1u, 1u, 1u, 100u, 5000u) \
    X(0x00a1u, 1u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x00c0u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x00c2u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x00c4u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x00c6u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x00c8u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x00ccu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x00ceu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x00d0u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x00d2u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0100u, 1u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0101u, 2u, 1u, 1u, 40u, 240000u) \
    X(0x0103u, 2u, 1u, 1u, 1u, 8640000u) \
    X(0x0110u, 1u, 1u, 1u, 0u, 8u) \
    X(0x0111u, 1u, 1u, 1u, 0u, 12u) \
    X(0x0112u, 2u, 8u, 1u, 0u, 0xffffffffu) \
    X(0x0122u, 2u, 8u, 1u, 0u, 0xffffffffu) \
    X(0x0132u, 2u, 8u, 1u, 0u, 0xffffffffu) \
    X(0x0142u, 2u, 12u, 1u, 0u, 0xffffffffu) \
    X(0x015au, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x015cu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0170u, 1u, 1u, 1u, 0u, 8u) \
    X(0x0171u, 1u, 1u, 1u, 0u, 12u) \
    X(0x0172u, 2u, 8u, 1u, 0u, 0xffffffffu) \
    X(0x0182u, 2u, 8u, 1u, 0u, 0xffffffffu) \
    X(0x0192u, 2u, 8u, 1u, 0u, 0xffffffffu) \
    X(0x01a2u, 2u, 12u, 1u, 0u, 0xffffffffu) \
    X(0x01bau, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x01bcu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0200u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0202u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0204u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0206u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0208u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x020au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x020cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x020eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0210u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0212u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0214u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0216u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0218u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x021au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x021cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x021eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0220u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0222u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0224u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x022cu, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0234u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0240u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0242u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0244u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0246u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0248u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x024au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x024cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x024eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0250u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0252u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0254u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0256u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0258u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x025au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x025cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x025eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0260u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0262u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0264u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x026cu, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0274u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0300u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0302u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0304u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0306u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0308u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x030au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x030cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x030eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0310u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0312u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0314u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0316u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0318u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0320u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0328u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0330u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0332u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0334u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0336u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0338u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x033au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x033cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x033eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0340u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0342u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0344u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0346u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0348u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0350u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0358u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0380u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0382u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0384u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0386u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0388u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x038au, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x038cu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x038eu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0390u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0392u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0394u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0396u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0398u, 2u, 4u, 1u, 0u, 0xffffffffu) \
    X(0x03a0u, 2u, 4u, 1u, 0u, 0xffffffffu) \
    X(0x03a8u, 2u, 4u, 1u, 0u, 0xffffffffu) \
    X(0x03b0u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03b2u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03b4u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03b6u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03b8u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03bau, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03bcu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03beu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03c0u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03c2u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03c4u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03c6u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x03c8u, 2u, 4u, 1u, 0u, 0xffffffffu) \
    X(0x03d0u, 2u, 4u, 1u, 0u, 0xffffffffu) \
    X(0x03d8u, 2u, 4u, 1u, 0u, 0xffffffffu) \
    X(0x03e0u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0400u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0402u, 2u, 12u, 0u, 0u, 0xffffffffu) \
    X(0x041au, 2u, 12u, 0u, 0u, 0xffffffffu) \
    X(0x0432u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0434u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0436u, 2u, 24u, 0u, 0u, 0xffffffffu) \
    X(0x0466u, 2u, 24u, 0u, 0u, 0xffffffffu) \
    X(0x0496u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0498u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x04a0u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04a2u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04a4u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04a6u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04a8u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04aau, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04acu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04aeu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04b0u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04b2u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04b4u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04b6u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04b8u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04bau, 2u, 12u, 0u, 0u, 0xffffffffu) \
    X(0x04d2u, 2u, 12u, 0u, 0u, 0xffffffffu) \
    X(0x04eau, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04ecu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x04eeu, 2u, 24u, 0u, 0u, 0xffffffffu) \
    X(0x051eu, 2u, 24u, 0u, 0u, 0xffffffffu) \
    X(0x054eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0550u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0558u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x055au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x055cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x055eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0560u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0562u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0564u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0566u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0568u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x056au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x056cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x056eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0570u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0580u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0582u, 2u, 12u, 1u, 0u, 0xffffffffu) \
    X(0x059au, 2u, 12u, 1u, 0u, 0xffffffffu) \
    X(0x05b2u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x05b4u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x05b6u, 2u, 24u, 1u, 0u, 0xffffffffu) \
    X(0x05e6u, 2u, 24u, 1u, 0u, 0xffffffffu) \
    X(0x0616u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0618u, 2u, 4u, 1u, 0u, 0xffffffffu) \
    X(0x0620u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0622u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0624u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0626u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0628u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x062au, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x062cu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x062eu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0630u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0632u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0634u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0636u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0638u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x063au, 2u, 12u, 1u, 0u, 0xffffffffu) \
    X(0x0652u, 2u, 12u, 1u, 0u, 0xffffffffu) \
    X(0x066au, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x066cu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x066eu, 2u, 24u, 1u, 0u, 0xffffffffu) \
    X(0x069eu, 2u, 24u, 1u, 0u, 0xffffffffu) \
    X(0x06ceu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06d0u, 2u, 4u, 1u, 0u, 0xffffffffu) \
    X(0x06d8u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06dau, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06dcu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06deu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06e0u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06e2u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06e4u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06e6u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06e8u, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06eau, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06ecu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x06eeu, 2u, 1u, 1u, 0u, 0xffffffffu) \
    X(0x0700u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0702u, 2u, 12u, 0u, 0u, 0xffffffffu) \
    X(0x071au, 2u, 12u, 0u, 0u, 0xffffffffu) \
    X(0x0732u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0734u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0736u, 2u, 24u, 0u, 0u, 0xffffffffu) \
    X(0x0766u, 2u, 24u, 0u, 0u, 0xffffffffu) \
    X(0x0796u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0798u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x07a0u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07a2u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07a4u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07a6u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07a8u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07aau, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07acu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07aeu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07b0u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07b2u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07b4u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07b6u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07b8u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07bau, 2u, 12u, 0u, 0u, 0xffffffffu) \
    X(0x07d2u, 2u, 12u, 0u, 0u, 0xffffffffu) \
    X(0x07eau, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07ecu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x07eeu, 2u, 24u, 0u, 0u, 0xffffffffu) \
    X(0x081eu, 2u, 24u, 0u, 0u, 0xffffffffu) \
    X(0x084eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0850u, 2u, 4u, 0u, 0u, 0xffffffffu) \
    X(0x0858u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x085au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x085cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x085eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0860u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0862u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0864u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0866u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0868u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x086au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x086cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x086eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0900u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0901u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0902u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0904u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0905u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0906u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0908u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x090au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x090cu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x090eu, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0910u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0911u, 1u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0912u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0914u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0916u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x0918u, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x091au, 2u, 1u, 0u, 0u, 0xffffffffu) \
    X(0x091cu, 2u, 1u, 0u, 0u, 0xffffffffu)

/* Fails to compile where a condition does not hold (C99 has no _Static_assert). */
#define FD_ASSERT(name, condition) typedef char fd_assert_##name[(condition) ? 1 : -1]

/* One axis of a gain bank; in the map those of map 4 stand in another place. */
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
    float stribeck_feedforward;
    float stribeck_speed;
    float viscous_difference_feedforward;
    float ripple_cosine[4];
    float ripple_sine[4];
    float ripple_period[4];
    float friction_top_speed;
    float friction_forward[12];
    float friction_backward[12];
    float table_start;
    float table_step;
    float load_table[24];
    float local_friction_table[24];
    float table_fade_speed;
    float ripple_fade_speed[4];
    float presliding_feedforward;
    float presliding_distance;
    float backlash_offset;
    float backlash_distance;
    float deadband_inverse;
    float deadband_smoothing;
    float cross_inertia_feedforward;
    float cross_viscous_feedforward;
    float cross_coulomb_feedforward;
    float transmission_loss;
    float transmitted_inertia;
    float transmitted_friction;
};
FD_ASSERT(proportional, offsetof(struct fd_gain_bank, proportional) == 0u);
FD_ASSERT(derivative, offsetof(struct fd_gain_bank, derivative) == 4u);
FD_ASSERT(integral, offsetof(struct fd_gain_bank, integral) == 8u);
FD_ASSERT(velocity_filter, offsetof(struct fd_gain_bank, velocity_filter) == 12u);
FD_ASSERT(inertia_feedforward, offsetof(struct fd_gain_bank, inertia_feedforward) == 16u);
FD_ASSERT(viscous_feedforward, offsetof(struct fd_gain_bank, viscous_feedforward) == 20u);
FD_ASSERT(coulomb_feedforward, offsetof(struct fd_gain_bank, coulomb_feedforward) == 24u);
FD_ASSERT(coulomb_smoothing, offsetof(struct fd_gain_bank, coulomb_smoothing) == 28u);
FD_ASSERT(offset_feedforward, offsetof(struct fd_gain_bank, offset_feedforward) == 32u);
FD_ASSERT(stribeck_feedforward, offsetof(struct fd_gain_bank, stribeck_feedforward) == 36u);
FD_ASSERT(stribeck_speed, offsetof(struct fd_gain_bank, stribeck_speed) == 40u);
FD_ASSERT(viscous_difference_feedforward, offsetof(struct fd_gain_bank, viscous_difference_feedforward) == 44u);
FD_ASSERT(ripple_cosine, offsetof(struct fd_gain_bank, ripple_cosine) == 48u);
FD_ASSERT(ripple_sine, offsetof(struct fd_gain_bank, ripple_sine) == 64u);
FD_ASSERT(ripple_period, offsetof(struct fd_gain_bank, ripple_period) == 80u);
FD_ASSERT(friction_top_speed, offsetof(struct fd_gain_bank, friction_top_speed) == 96u);
FD_ASSERT(friction_forward, offsetof(struct fd_gain_bank, friction_forward) == 100u);
FD_ASSERT(friction_backward, offsetof(struct fd_gain_bank, friction_backward) == 148u);
FD_ASSERT(table_start, offsetof(struct fd_gain_bank, table_start) == 196u);
FD_ASSERT(table_step, offsetof(struct fd_gain_bank, table_step) == 200u);
FD_ASSERT(load_table, offsetof(struct fd_gain_bank, load_table) == 204u);
FD_ASSERT(local_friction_table, offsetof(struct fd_gain_bank, local_friction_table) == 300u);
FD_ASSERT(table_fade_speed, offsetof(struct fd_gain_bank, table_fade_speed) == 396u);
FD_ASSERT(ripple_fade_speed, offsetof(struct fd_gain_bank, ripple_fade_speed) == 400u);
FD_ASSERT(presliding_feedforward, offsetof(struct fd_gain_bank, presliding_feedforward) == 416u);
FD_ASSERT(presliding_distance, offsetof(struct fd_gain_bank, presliding_distance) == 420u);
FD_ASSERT(backlash_offset, offsetof(struct fd_gain_bank, backlash_offset) == 424u);
FD_ASSERT(backlash_distance, offsetof(struct fd_gain_bank, backlash_distance) == 428u);
FD_ASSERT(deadband_inverse, offsetof(struct fd_gain_bank, deadband_inverse) == 432u);
FD_ASSERT(deadband_smoothing, offsetof(struct fd_gain_bank, deadband_smoothing) == 436u);
FD_ASSERT(cross_inertia_feedforward, offsetof(struct fd_gain_bank, cross_inertia_feedforward) == 440u);
FD_ASSERT(cross_viscous_feedforward, offsetof(struct fd_gain_bank, cross_viscous_feedforward) == 444u);
FD_ASSERT(cross_coulomb_feedforward, offsetof(struct fd_gain_bank, cross_coulomb_feedforward) == 448u);
FD_ASSERT(transmission_loss, offsetof(struct fd_gain_bank, transmission_loss) == 452u);
FD_ASSERT(transmitted_inertia, offsetof(struct fd_gain_bank, transmitted_inertia) == 456u);
FD_ASSERT(transmitted_friction, offsetof(struct fd_gain_bank, transmitted_friction) == 460u);
FD_ASSERT(gain_bank, sizeof(struct fd_gain_bank) == 464u);

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
FD_ASSERT(page, sizeof(struct fd_page) == 2u * FD_PAGE_WORDS);
FD_ASSERT(page_fits_its_slot, FD_PAGE_WORDS <= FD_PAGE_SLOT_REGISTERS);
FD_ASSERT(page_fits_one_read, FD_PAGE_WORDS <= 125u);

#endif
