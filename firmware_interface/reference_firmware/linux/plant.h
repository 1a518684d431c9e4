/* A rigid axis with viscous and Coulomb friction, sticking included: the drive that the board of
 * firmware_interface/virtual becomes when nothing in it deforms. Stepped exactly. */
#ifndef PLANT_H
#define PLANT_H

struct plant {
    double inertia; /* kg*m^2 */
    double viscous_friction; /* N*m*s/rad */
    double coulomb_friction; /* N*m */
    double offset; /* N*m */
    double position_rad;
    double velocity_rad_s;
};

/* Let time pass under a constant effort. */
void plant_advance(struct plant *plant, double effort_nm, double time_s);

#endif
