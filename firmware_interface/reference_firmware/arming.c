#include "arming.h"

#include <string.h>

#include "drive.h"
#include "gain_banks.h"
#include "machine.h"
#include "port.h"
#include "setpoints.h"
#include "trajectory_check.h"

/* A Cortex-M4 with 8 sines on each axis takes about half a millisecond for as many: little beside
 * the time that a frame is on the line. */
#define SLICE_SAMPLES 16u

static struct trajectory armed;
static struct trajectory_check check;
static bool pending;

void arming_init(void)
{
    pending = false;
    check.samples_left = 0;
}

/* Whether ARM may begin. */
static enum fd_result readiness(void)
{
    if (machine.state != FD_STATE_IDLE) {
        return FD_RESULT_WRONG_STATE;
    }
    if (!drive_powered()) {
        return FD_RESULT_NOT_ENABLED;
    }
    return machine_moving() ? FD_RESULT_NOT_AT_REST : FD_RESULT_DONE;
}

enum fd_result arming_begin(uint32_t crc)
{
    struct trajectory asked_for;
    struct law_memory memory[FD_AXES];
    /* the words are the main loop's: they stay as they are while it is here */
    const bool readable = trajectory_crc() == crc && trajectory_read(&asked_for);
    port_lock();
    enum fd_result result = readiness();
    if (result == FD_RESULT_DONE) {
        result = readable ? FD_RESULT_PENDING : FD_RESULT_BAD_TRAJECTORY;
    }
    if (result == FD_RESULT_PENDING) {
        armed = asked_for;
        trajectory_begin(&armed, setpoints_current());
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            memory[axis] = *drive_memory(axis);
        }
        trajectory_check_begin(&check, &armed, gain_banks_active(), memory);
        machine.state = FD_STATE_CHECKING;
        pending = true;
    }
    port_unlock();
    return result;
}

enum fd_result arming_go_on(void)
{
    const bool allowed = trajectory_check_go_on(&check, SLICE_SAMPLES);
    enum fd_result result = FD_RESULT_PENDING;
    port_lock();
    if (machine.state != FD_STATE_CHECKING) {
        result = FD_RESULT_WRONG_STATE; /* a fault, a stop or a roll-back came meanwhile */
    } else if (!allowed) {
        machine.state = FD_STATE_IDLE;
        result = FD_RESULT_TRAJECTORY_LIMITS;
    } else if (check.samples_left == 0) {
        machine.state = FD_STATE_ARMED;
        result = FD_RESULT_DONE;
    }
    port_unlock();
    pending = result == FD_RESULT_PENDING;
    if (!pending) {
        check.samples_left = 0;
    }
    return result;
}

bool arming_pending(void)
{
    return pending;
}

uint32_t arming_samples_left(void)
{
    return check.samples_left;
}

void arming_start(void)
{
    machine_follow(&armed);
}
