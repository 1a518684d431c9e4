#include "handover.h"

#include <math.h>
#include <string.h>

#include "gain_banks.h"
#include "port.h"
#include "setpoints.h"

#define MOST_SHOWN_NM 1e6f
#define SHARE_OF_EFFORT 0.2f /* that may jump where nothing is said of it */

static struct fd_gain_bank offered[FD_AXES];
static enum fd_result result;
static float jump_nm[FD_AXES];

void handover_init(void)
{
    result = FD_RESULT_NONE;
    memset(jump_nm, 0, sizeof jump_nm);
}

bool handover_capable(void)
{
    bool capable = true;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        capable = capable && port_settings()->axis[axis].effort_jump_nm > 0.0f;
    }
    return capable;
}

void handover_offer(const struct fd_gain_bank gains[FD_AXES])
{
    memcpy(offered, gains, sizeof offered);
    result = FD_RESULT_PENDING;
}

void handover_withdraw(void)
{
    result = result == FD_RESULT_PENDING ? FD_RESULT_WRONG_STATE : result;
}

enum fd_result handover_result(void)
{
    return result;
}

float handover_jump_nm(unsigned axis)
{
    return jump_nm[axis];
}

/* As a register says it. */
static float shown(float jump)
{
    return isnan(jump) ? MOST_SHOWN_NM : fminf(fmaxf(jump, -MOST_SHOWN_NM), MOST_SHOWN_NM);
}

static float jump_limit_nm(const struct axis_settings *limit)
{
    return limit->effort_jump_nm > 0.0f ? limit->effort_jump_nm
                                        : SHARE_OF_EFFORT * limit->effort_nm;
}

/* Every comparison is written so that what is no number fails. */
static enum fd_result judged(const struct transfer *transfer)
{
    enum fd_result found = FD_RESULT_DONE;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const struct axis_settings *limit = &port_settings()->axis[axis];
        const struct setpoint *begun = &transfer->setpoints[axis];
        const float rest_rad = setpoints_rest_rad(transfer->setpoints, axis);
        if (!(fabsf(transfer->jump_nm[axis]) <= jump_limit_nm(limit))) {
            return FD_RESULT_EFFORT_JUMP;
        }
        if (!(fabsf(begun->velocity_rad_s) <= limit->speed_rad_s
              && fabsf(begun->position_rad) <= limit->travel_rad
              && fabsf(rest_rad) <= limit->travel_rad)) {
            found = FD_RESULT_TRAJECTORY_LIMITS;
        }
    }
    return found;
}

/* Put gains in force in the sample latched, unless they ask for too much. */
static enum fd_result exchanged(const struct fd_gain_bank gains[FD_AXES],
                                const struct drive_sample *sample, bool moving)
{
    struct transfer transfer;
    drive_consider(gains, setpoints_current(), sample, moving, &transfer);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        jump_nm[axis] = shown(transfer.jump_nm[axis]);
    }
    const enum fd_result found = judged(&transfer);
    if (found == FD_RESULT_DONE) {
        drive_take_over(gains, &transfer);
        setpoints_take_up(transfer.setpoints, moving);
        gain_banks_commit(gains);
    }
    return found;
}

enum fd_result handover_at_rest(const struct fd_gain_bank gains[FD_AXES])
{
    struct drive_sample standing;
    if (!drive_powered()) { /* nothing acts that could jump */
        gain_banks_commit(gains);
        drive_set_gains(gains);
        return FD_RESULT_DONE;
    }
    drive_latched(&standing);
    return exchanged(gains, &standing, false);
}

void handover_decide(const struct drive_sample *sample, enum fd_result taken, bool moving)
{
    if (result != FD_RESULT_PENDING) {
        return;
    }
    if (taken != FD_RESULT_DONE || gain_banks_unconfirmed()) {
        result = FD_RESULT_WRONG_STATE;
        return;
    }
    result = exchanged(offered, sample, moving);
}
