#include "stop.h"

#include <math.h>

#define STOP_TIME_S 0.25f
#define STOP_ACCELERATION_RAD_S2 12.0f

float stop_acceleration_rad_s2(float velocity_rad_s, float acceleration_rad_s2, float duration_s)
{
    if (velocity_rad_s * acceleration_rad_s2 >= 0.0f) {
        return 0.0f;
    }
    const float most = 3.0f * fabsf(velocity_rad_s) / duration_s;
    return copysignf(fminf(fabsf(acceleration_rad_s2), most), acceleration_rad_s2);
}

float stop_duration_s(const struct setpoint setpoints[FD_AXES])
{
    float duration = STOP_TIME_S;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const float speed = fabsf(setpoints[axis].velocity_rad_s);
        duration = fmaxf(duration, 1.5f * speed / STOP_ACCELERATION_RAD_S2);
    }
    return duration;
}

struct setpoint stop_setpoint(const struct setpoint *from, float duration_s, float share)
{
    const float speed = from->velocity_rad_s, gain = from->acceleration_rad_s2 * duration_s;
    const float left = 1.0f - share;
    const float way = speed * share * (1.0f - share * share + 0.5f * share * share * share)
        + gain * share * share * (0.5f - share / 1.5f + 0.25f * share * share);
    return (struct setpoint){
        from->position_rad + duration_s * way,
        speed * (1.0f - share * share * (3.0f - 2.0f * share)) + gain * share * left * left,
        speed / duration_s * -6.0f * share * left
            + from->acceleration_rad_s2 * left * (1.0f - 3.0f * share),
    };
}
