#include "transfer.h"

#include <math.h>

#include "stop.h"

/* A setpoint from which a stop goes on as the far one's did. */
static struct setpoint between(const struct setpoint *near, const struct setpoint *far,
                               float share, float stop_s)
{
    const float velocity =
        near->velocity_rad_s + share * (far->velocity_rad_s - near->velocity_rad_s);
    return (struct setpoint){
        near->position_rad + share * (far->position_rad - near->position_rad),
        velocity,
        stop_acceleration_rad_s2(velocity, far->acceleration_rad_s2, stop_s),
    };
}

/* Where between its ends a jump vanishes, as if it were linear; else the smaller end. */
static float share_of(float near_nm, float far_nm)
{
    if (near_nm * far_nm < 0.0f) {
        return near_nm / (near_nm - far_nm);
    }
    return fabsf(near_nm) <= fabsf(far_nm) ? 0.0f : 1.0f;
}

/* The controller of an axis, its reference moved from the old setpoint to another one. */
static struct controller shifted(const struct controller *controller, const struct setpoint *from,
                                 const struct setpoint *to)
{
    struct controller moved = *controller;
    moved.memory.reference_rad += to->position_rad - from->position_rad;
    return moved;
}

/* What the law asks for at a setpoint; NaN where that is no number. */
static float asked_nm(struct controller controller, const struct fd_gain_bank *gains,
                      const struct setpoint *setpoint, const struct setpoint *other,
                      unsigned axis, const struct transfer_from *from)
{
    bool finite = true;
    const float effort =
        controller_law_nm(&controller, gains, setpoint, other, from->counts[axis],
                          from->rad_per_count, from->limit_nm[axis], &finite);
    return finite ? effort : NAN;
}

/* The effort of the gains in force; NaN where that is no number. */
static float effort_now_nm(unsigned axis, const struct transfer_from *from)
{
    struct controller controller = from->controllers[axis];
    bool finite = true;
    const float effort = controller_effort_nm(
        &controller, &from->gains[axis], &from->setpoints[axis],
        &from->setpoints[OTHER_AXIS(axis)], from->counts[axis], from->rad_per_count,
        from->limit_nm[axis], &finite);
    return finite ? effort : NAN;
}

/* The axis as it is, as a setpoint without error; what the new gains have not is forgotten. */
static struct setpoint take_over(struct controller *controller, const struct fd_gain_bank *gains,
                                 unsigned axis, const struct transfer_from *from)
{
    law_keep(&controller->memory, gains);
    struct controller seen = *controller;
    controller_observe(&seen, gains, from->setpoints[axis].position_rad, from->counts[axis],
                       from->rad_per_count);
    const float position = (float)from->counts[axis] * from->rad_per_count;
    return (struct setpoint){
        position - seen.memory.backlash_rad, from->moving ? seen.velocity_rad_s : 0.0f, 0.0f};
}

/* Where the reference of an axis begins. */
static struct setpoint beginning(const struct controller *taken, const struct fd_gain_bank *gains,
                                 const struct setpoint *near, float now_nm, float stop_s,
                                 unsigned axis, const struct transfer_from *from)
{
    const struct setpoint *far = &from->setpoints[axis];
    float jump_nm[2];
    for (unsigned end = 0; end < 2u; end++) {
        const struct setpoint at = between(near, far, (float)end, stop_s);
        jump_nm[end] = asked_nm(shifted(taken, far, &at), gains, &at,
                                &from->setpoints[OTHER_AXIS(axis)], axis, from) - now_nm;
    }
    return between(near, far, share_of(jump_nm[0], jump_nm[1]), stop_s);
}

void transfer_consider(struct transfer *transfer, const struct fd_gain_bank gains[FD_AXES],
                       const struct transfer_from *from)
{
    struct setpoint near[FD_AXES];
    float now_nm[FD_AXES];
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        transfer->controllers[axis] = from->controllers[axis];
        now_nm[axis] = effort_now_nm(axis, from);
        near[axis] = take_over(&transfer->controllers[axis], &gains[axis], axis, from);
    }
    const float stop_s = fmaxf(stop_duration_s(near), stop_duration_s(from->setpoints));
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        transfer->setpoints[axis] = beginning(&transfer->controllers[axis], &gains[axis],
                                              &near[axis], now_nm[axis], stop_s, axis, from);
    }
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        struct controller *taken = &transfer->controllers[axis];
        const struct setpoint *begun = &transfer->setpoints[axis];
        *taken = shifted(taken, &from->setpoints[axis], begun);
        transfer->jump_nm[axis] =
            asked_nm(*taken, &gains[axis], begun, &transfer->setpoints[OTHER_AXIS(axis)], axis, from)
            - now_nm[axis];
        taken->carried_nm = -transfer->jump_nm[axis];
    }
}
