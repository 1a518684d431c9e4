#include "conditioning.h"

#include <math.h>

#include "../port.h"
#include "bridging.h"
#include "pause.h"

#define PI 3.141592653589793
#define BLOCKS PERIOD_BLOCKS
#define LAST (PERIOD_BLOCKS / 2u) /* frequency */
#define NOISE_SHARE 0.05 /* of encoder noise in the acceleration */
/* Samples and blocks in a period of the cut-off, and its periods in the motion: at least. Why, says
 * edge_ident/signals/conditioning.py. */
#define SAMPLED_PER_PERIOD 20.0
#define BLOCKS_PER_PERIOD 2.5
#define FEWEST_PERIODS 10.0
#define PIECE 8u /* numbers from one pause to the next */

/* What is the same for all samples. */
struct scales {
    double samples;
    double count_rad;
    double count_nm;
    double sampling_s;
    double block_s;
    double late_s;
    double noise; /* of a sample's position, in counts */
    double cutoff_hz;
};

static double cutoff_hz(const struct scales *scales)
{
    const double noise_rad = scales->count_rad * scales->noise, period_s = BLOCKS * scales->block_s;
    const double rate = 2.0 * PI * 2.0 * PI;
    const double at_1_hz =
        sqrt(rate * rate / 5.0 * 2.0 * noise_rad * noise_rad * scales->sampling_s);
    const double wanted = pow(NOISE_SHARE * NETWORK_ACCELERATION_RMS / at_1_hz, 0.4);
    const double highest = fmin(1.0 / (SAMPLED_PER_PERIOD * scales->sampling_s),
                                1.0 / scales->block_s / BLOCKS_PER_PERIOD);
    return fmax(FEWEST_PERIODS / period_s, fmin(highest, wanted));
}

static struct scales scales_of(const struct captured_axis *captured)
{
    const struct board_settings *settings = port_settings();
    const double sampling_s = SAMPLE_PERIOD_NS * 1e-9, samples = captured->samples;
    const double white = sqrt(captured->third_differences / (samples - 3.0) / 20.0);
    struct scales scales = {
        .samples = samples,
        .count_rad = 2.0 * PI / settings->counts_per_turn,
        .count_nm = (double)settings->effort_per_count_nm,
        .sampling_s = sampling_s,
        .block_s = samples * sampling_s / BLOCKS,
        .late_s = settings->control_delay_ns * 1e-9 + 0.5 * sampling_s,
        .noise = fmax(white, 1.0 / sqrt(12.0)),
    };
    scales.cutoff_hz = cutoff_hz(&scales);
    return scales;
}

static double rate_of(const struct scales *scales, uint32_t frequency)
{
    return 2.0 * PI * frequency / (BLOCKS * scales->block_s);
}

/* A Butterworth filter of fourth order, run both ways. */
static double gain_of(const struct scales *scales, uint32_t frequency)
{
    const double ratio = frequency / (BLOCKS * scales->block_s) / scales->cutoff_hz;
    const double squared = ratio * ratio, fourth = squared * squared;
    return 1.0 / (1.0 + fourth * fourth);
}

static struct complex scaled(struct complex number, double factor)
{
    return complex_of(factor * number.re, factor * number.im);
}

static struct complex turned(struct complex number, double angle)
{
    return complex_product(number, complex_of(cos(angle), sin(angle)));
}

/* The derivative's harmonic. */
static struct complex derived(struct complex number, double rate)
{
    return complex_of(-rate * number.im, rate * number.re);
}

static void pause_between(uint32_t number)
{
    if (number % PIECE == 0u) {
        identification_pause();
    }
}

/* ---- from the capture to filtered harmonics */

static void take(struct conditioning_memory *memory, const struct scales *scales)
{
    for (uint32_t n = 0; n < BLOCKS; n++) {
        pause_between(n);
        memory->spectrum[n] =
            complex_of(scales->count_rad * ((double)memory->captured.position[n] / scales->samples),
                       scales->count_nm * ((double)memory->captured.effort[n] / scales->samples));
    }
}

static void filter(struct conditioning_memory *memory, const struct scales *scales)
{
    for (uint32_t k = 0; k <= LAST; k++) {
        pause_between(k);
        const double gain = gain_of(scales, k);
        memory->spectrum[k] = scaled(memory->spectrum[k], gain);
        if (k > 0 && k < LAST) {
            memory->spectrum[BLOCKS - k] = scaled(memory->spectrum[BLOCKS - k], gain);
        }
    }
}

/* ---- the phase */

/* Blocks by which the period is to be turned: where the velocity matches that of the network's
 * motion best, by a parabola through the best and its neighbours. */
static double shift_of(struct conditioning_memory *memory, const struct scales *scales)
{
    struct complex *match = memory->motion;
    uint32_t best = 0;
    for (uint32_t k = 0; k < BLOCKS; k++) {
        match[k] = complex_of(0.0, 0.0);
    }
    for (uint32_t k = 1; k <= NETWORK_HARMONICS; k++) {
        struct complex position, effort;
        fourier_parts(memory->spectrum, k, &position, &effort);
        match[k] = complex_product(
            complex_of(network_velocity[0][k - 1u], network_velocity[1][k - 1u]),
            complex_conjugate(derived(position, rate_of(scales, k))));
    }
    fourier_backward(match);
    for (uint32_t n = 1; n < BLOCKS; n++) {
        best = match[n].re > match[best].re ? n : best;
    }
    const double before = match[(best + BLOCKS - 1u) % BLOCKS].re;
    const double after = match[(best + 1u) % BLOCKS].re;
    const double curvature = before - 2.0 * match[best].re + after;
    return best + (curvature < 0.0 ? 0.5 * (before - after) / curvature : 0.0);
}

/* ---- the signals */

/* Velocity and acceleration; the first and the last harmonic have no derivative. */
static void differentiate(struct conditioning_memory *memory, const struct scales *scales,
                          double shift)
{
    memory->motion[0] = memory->motion[LAST] = complex_of(0.0, 0.0);
    for (uint32_t k = 1; k < LAST; k++) {
        const double rate = rate_of(scales, k);
        struct complex position, effort;
        pause_between(k);
        fourier_parts(memory->spectrum, k, &position, &effort);
        const struct complex velocity =
            derived(turned(position, -rate * shift * scales->block_s), rate);
        fourier_put_parts(memory->motion, k, velocity, derived(velocity, rate));
    }
    fourier_backward(memory->motion);
    for (uint32_t n = 0; n < BLOCKS; n++) {
        memory->motion[n] = scaled(memory->motion[n], 1.0 / BLOCKS);
    }
}

/* Sign of the velocity: its mean over each block, as effort and position are means. */
static void take_direction(struct conditioning_memory *memory, const struct scales *scales)
{
    for (uint32_t n = 0; n < BLOCKS; n++) {
        pause_between(n);
        const double reached = fmax(0.5 * scales->block_s * fabs(memory->motion[n].im), 1e-300);
        memory->loads[n] =
            complex_of(fmax(-1.0, fmin(1.0, memory->motion[n].re / reached)), 0.0);
    }
}

/* Direction and effort, filtered alike. */
static void filter_loads(struct conditioning_memory *memory, const struct scales *scales,
                         double shift)
{
    const double late_s = shift * scales->block_s + scales->late_s;
    fourier_forward(memory->loads);
    memory->loads[0] = complex_of(memory->loads[0].re, memory->spectrum[0].im);
    memory->loads[LAST] = complex_of(gain_of(scales, LAST) * memory->loads[LAST].re,
                                     memory->spectrum[LAST].im);
    for (uint32_t k = 1; k < LAST; k++) {
        struct complex position, effort;
        const struct complex direction = scaled(memory->loads[k], gain_of(scales, k));
        pause_between(k);
        fourier_parts(memory->spectrum, k, &position, &effort);
        fourier_put_parts(memory->loads, k, direction,
                          turned(effort, -rate_of(scales, k) * late_s));
    }
    fourier_backward(memory->loads);
    for (uint32_t n = 0; n < BLOCKS; n++) {
        memory->loads[n] = scaled(memory->loads[n], 1.0 / BLOCKS);
    }
}

/* ---- subsampling */

/* Two signals to fewer points: the first coefficients of the orthonormal DCT-II, transformed back
 * at that length. */
static void subsample(struct conditioning_memory *memory, const struct complex *signals,
                      double *first, double *second)
{
    struct complex *work = memory->spectrum, coefficients[NETWORK_POINTS];
    for (uint32_t n = 0; n < LAST; n++) {
        work[n] = signals[2u * n];
        work[BLOCKS - 1u - n] = signals[2u * n + 1u];
    }
    fourier_forward(work);
    for (uint32_t k = 0; k < NETWORK_POINTS; k++) {
        struct complex of_first, of_second;
        const double angle = -0.5 * PI * k / BLOCKS, factor = (k > 0 ? 2.0 : 1.0) / BLOCKS;
        pause_between(k);
        fourier_parts(work, k, &of_first, &of_second);
        coefficients[k] = complex_of(factor * turned(of_first, angle).re,
                                     factor * turned(of_second, angle).re);
    }
    for (uint32_t n = 0; n < NETWORK_POINTS; n++) {
        first[n] = second[n] = 0.0;
        for (uint32_t k = 0; k < NETWORK_POINTS; k++) {
            const double cosine = memory->cosines[k * (2u * n + 1u) % (4u * NETWORK_POINTS)];
            first[n] += coefficients[k].re * cosine;
            second[n] += coefficients[k].im * cosine;
        }
        identification_pause();
    }
}

static void bridge_standstills(struct conditioning_memory *memory, const struct scales *scales,
                               double shift, struct conditioned *result)
{
    const uint32_t turn = (uint32_t)((int32_t)floor(shift + 0.5) + (int32_t)BLOCKS) % BLOCKS;
    const struct standstills rule = {
        .turn = turn,
        .width = (uint32_t)ceil(1.0 / (scales->cutoff_hz * scales->block_s)),
        .largest_range = 8.0 * scales->noise,
        .samples = scales->samples,
    };
    mark_standstills(memory->captured.position, &rule, memory->still);
    result->moving_share = moving_share(memory->still);
    identification_pause();
    bridge(memory->motion, memory->still);
    identification_pause();
    bridge(memory->loads, memory->still);
}

void condition(struct conditioning_memory *memory, struct conditioned *result)
{
    const struct scales scales = scales_of(&memory->captured);
    for (uint32_t n = 0; n < 4u * NETWORK_POINTS; n++) {
        memory->cosines[n] = cos(PI * n / (2u * NETWORK_POINTS));
        pause_between(n);
    }
    result->last_column = 1.0;
    take(memory, &scales);
    fourier_forward(memory->spectrum);
    filter(memory, &scales);
    const double shift = shift_of(memory, &scales);
    differentiate(memory, &scales, shift);
    take_direction(memory, &scales);
    filter_loads(memory, &scales, shift);
    bridge_standstills(memory, &scales, shift, result);
    subsample(memory, memory->motion, result->column[1], result->column[0]);
    subsample(memory, memory->loads, result->column[2], result->effort);
}
