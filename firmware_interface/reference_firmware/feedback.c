#include "feedback.h"

#include <math.h>
#include <string.h>

/* Polynomials in the delay by one sample, w = 1 / z. In double: the poles of a slow loop lie so close
 * together at w = 1 that the rounding of float would move them by more than their distance. */
#define TERMS 48u /* the longest control delay is 40 samples */

struct polynomial {
    unsigned terms;
    double at[TERMS];
};

static const struct polynomial difference = {2u, {1.0, -1.0}}; /* 1 - w */

static struct polynomial product(const struct polynomial *a, const struct polynomial *b)
{
    struct polynomial result = {a->terms + b->terms - 1u, {0.0}};
    for (unsigned i = 0; i < a->terms; i++) {
        for (unsigned k = 0; k < b->terms; k++) {
            result.at[i + k] += a->at[i] * b->at[k];
        }
    }
    return result;
}

static struct polynomial sum(const struct polynomial *a, double factor, const struct polynomial *b)
{
    struct polynomial result = *a;
    result.terms = a->terms > b->terms ? a->terms : b->terms;
    for (unsigned k = 0; k < b->terms; k++) {
        result.at[k] += factor * b->at[k];
    }
    return result;
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

/* Effort over position, with the factors 1 - w that it and the plant do not share: a law without
 * integral part has none below, and one without proportional part either has one above, which takes
 * away the plant's. */
static struct polynomial characteristic(const struct fd_gain_bank *gains,
                                        const struct polynomial *over,
                                        const struct polynomial *under)
{
    const double period_s = SAMPLE_PERIOD_NS * 1e-9;
    const double taken = period_s / ((double)gains->velocity_filter + period_s);
    const struct polynomial filter = {2u, {1.0, taken - 1.0}};
    const double proportional = (double)gains->proportional;
    const double integral = (double)gains->integral * period_s;
    const double derivative = (double)gains->derivative * taken / period_s;
    struct polynomial law = {1u, {derivative}}, free = product(&filter, under);
    if (proportional > 0.0 || integral > 0.0) {
        law = product(&law, &difference);
        law = sum(&law, proportional, &filter);
        free = product(&free, &difference);
    }
    if (integral > 0.0) {
        law = product(&law, &difference);
        law = sum(&law, integral, &filter);
        free = product(&free, &difference);
    }
    law = product(&law, over);
    return sum(&free, 1.0, &law);
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
    struct polynomial over, under;
    const bool any = gains->proportional > 0.0f || gains->derivative > 0.0f || gains->integral > 0.0f;
    if (!any || !(axis->inertia > 0.0f)) {
        return true;
    }
    plant(axis, control_delay_ns, &over, &under);
    struct polynomial loop = characteristic(gains, &over, &under);
    return all_decay(&loop);
}
