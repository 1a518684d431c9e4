#include "feedback.h"

#include <math.h>
#include <string.h>

/* Polynomials in the delay by one sample, w = 1 / z. In double: the poles of a slow loop lie so close
 * together at w = 1 that the rounding of float would move them by more than their distance. */
#define TERMS 48u /* the longest control delay is 40 samples */

/* What is above its terms is 0. */
struct polynomial {
    unsigned terms;
    double at[TERMS];
};

static const struct polynomial difference = {2u, {1.0, -1.0}}; /* 1 - w */

static void product(struct polynomial *a, const struct polynomial *b)
{
    struct polynomial result = {a->terms + b->terms - 1u, {0.0}};
    for (unsigned i = 0; i < a->terms; i++) {
        for (unsigned k = 0; k < b->terms; k++) {
            result.at[i + k] += a->at[i] * b->at[k];
        }
    }
    *a = result;
}

/* Position of a rigid body after a unit effort for so long. */
static double moved(double inertia, double friction, double time_s)
{
    const double share = friction * time_s / inertia;
    if (time_s <= 0.0) {
        return 0.0;
    }
    return share < 1e-4 ? time_s * time_s / (2.0 * inertia) * (1.0 - share / 3.0)
                        : (time_s + inertia / friction * expm1(-share)) / friction;
}

/* Position over effort: numerator, and denominator without the integrating factor 1 - w. */
static void plant(const struct axis_settings *axis, uint32_t control_delay_ns,
                  struct polynomial *over, struct polynomial *under)
{
    const double inertia = (double)axis->inertia, friction = (double)axis->viscous_friction;
    const double period_s = SAMPLE_PERIOD_NS * 1e-9;
    const unsigned late = control_delay_ns / SAMPLE_PERIOD_NS;
    const double rest_s = control_delay_ns % SAMPLE_PERIOD_NS * 1e-9;
    const double decay = exp(-friction * period_s / inertia);
    double pulse[3], before = 0.0; /* position at the samples after a pulse of one period */
    for (unsigned k = 0; k < 3u; k++) {
        const double now = moved(inertia, friction, (double)(k + 1u) * period_s - rest_s);
        pulse[k] = now - before;
        before = now;
    }
    memset(over, 0, sizeof *over);
    over->terms = late + 4u;
    over->at[late + 1u] = pulse[0];
    over->at[late + 2u] = pulse[1] - (1.0 + decay) * pulse[0];
    over->at[late + 3u] = pulse[2] - (1.0 + decay) * pulse[1] + decay * pulse[0];
    *under = (struct polynomial){2u, {1.0, -decay}};
}

/* Add a part to the law: one factor 1 - w more below it, and in the loop without feedback. */
static void add_part(struct polynomial *law, struct polynomial *open, double gain,
                     const struct polynomial *filter)
{
    product(law, &difference);
    for (unsigned k = 0; k < filter->terms; k++) {
        law->at[k] += gain * filter->at[k];
    }
    product(open, &difference);
}

/* A law without integral part has no factor 1 - w below, and one without proportional part either
 * has one above, which takes away the plant's. */
static void characteristic(const struct fd_gain_bank *gains, const struct polynomial *over,
                           struct polynomial *open)
{
    const double period_s = SAMPLE_PERIOD_NS * 1e-9;
    const double taken = period_s / ((double)gains->velocity_filter + period_s);
    const struct polynomial filter = {2u, {1.0, taken - 1.0}};
    struct polynomial law = {1u, {(double)gains->derivative * taken / period_s}};
    product(open, &filter);
    if (gains->proportional > 0.0f || gains->integral > 0.0f) {
        add_part(&law, open, (double)gains->proportional, &filter);
    }
    if (gains->integral > 0.0f) {
        add_part(&law, open, (double)gains->integral * period_s, &filter);
    }
    product(&law, over);
    for (unsigned k = 0; k < law.terms; k++) {
        open->at[k] += law.at[k];
    }
    open->terms = open->terms > law.terms ? open->terms : law.terms;
}

/* Schur and Cohn: every root in w lies outside of the unit circle, every pole inside. */
static bool all_decay(struct polynomial *polynomial)
{
    double *at = polynomial->at;
    for (unsigned last = polynomial->terms - 1u; last > 0; last--) {
        const double reflected = at[last] / at[0];
        double reduced[TERMS];
        if (!(fabs(reflected) < 1.0)) {
            return false;
        }
        for (unsigned k = 0; k < last; k++) {
            reduced[k] = at[k] - reflected * at[last - k];
        }
        memcpy(at, reduced, last * sizeof *at);
    }
    return true;
}

bool feedback_stable(const struct fd_gain_bank *gains, const struct axis_settings *axis,
                     uint32_t control_delay_ns)
{
    struct polynomial over, loop;
    const bool any = gains->proportional > 0.0f || gains->derivative > 0.0f || gains->integral > 0.0f;
    if (!any || !(axis->inertia > 0.0f)) {
        return true;
    }
    plant(axis, control_delay_ns, &over, &loop);
    characteristic(gains, &over, &loop);
    return all_decay(&loop);
}
