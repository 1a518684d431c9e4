#include "plant.h"

#include <math.h>

/* Direction in which friction acts against: that of motion, or of the force that breaks loose;
 * 0 where the axis sticks. */
static double direction(const struct plant *plant, double force_nm)
{
    if (fabs(plant->velocity_rad_s) > 0.0) {
        return copysign(1.0, plant->velocity_rad_s);
    }
    return fabs(force_nm) <= plant->coulomb_friction ? 0.0 : copysign(1.0, force_nm);
}

void plant_advance(struct plant *plant, double effort_nm, double time_s)
{
    const double force_nm = effort_nm - plant->offset;
    const double decay_s = plant->inertia / plant->viscous_friction;
    while (time_s > 0.0) {
        const double sign = direction(plant, force_nm);
        if (!(fabs(sign) > 0.0)) {
            return;
        }
        /* the velocity decays towards that of steady motion; it stops where it crosses zero */
        const double steady =
            (force_nm - sign * plant->coulomb_friction) / plant->viscous_friction;
        const double excess = plant->velocity_rad_s - steady;
        double step_s = time_s;
        double end = steady + excess * exp(-step_s / decay_s);
        if (fabs(plant->velocity_rad_s) > 0.0 && end * sign <= 0.0) {
            step_s = fmin(decay_s * log(excess / -steady), time_s);
            end = 0.0;
        }
        plant->position_rad += steady * step_s + (plant->velocity_rad_s - end) * decay_s;
        plant->velocity_rad_s = end;
        time_s -= step_s;
    }
}
