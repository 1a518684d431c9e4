#include "fourier.h"

#include <math.h>

#include "pause.h"

#define PIECE 32u /* steps from one pause to the next */
#define TWO_PI_DOUBLE 6.283185307179586

struct complex complex_of(double re, double im)
{
    const struct complex number = {re, im};
    return number;
}

struct complex complex_sum(struct complex a, struct complex b)
{
    return complex_of(a.re + b.re, a.im + b.im);
}

struct complex complex_product(struct complex a, struct complex b)
{
    return complex_of(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
}

struct complex complex_conjugate(struct complex a)
{
    return complex_of(a.re, -a.im);
}

/* Places whose binary digits are each other's mirror image change contents. */
static void reorder(struct complex *values)
{
    uint32_t mirrored = 0;
    for (uint32_t place = 0; place < PERIOD_BLOCKS; place++) {
        if (place < mirrored) {
            const struct complex kept = values[place];
            values[place] = values[mirrored];
            values[mirrored] = kept;
        }
        uint32_t digit = PERIOD_BLOCKS / 2u;
        while (mirrored & digit) {
            mirrored ^= digit;
            digit /= 2u;
        }
        mirrored |= digit;
    }
}

static void transform(struct complex *values, double sign)
{
    uint32_t steps = 0;
    reorder(values);
    for (uint32_t half = 1; half < PERIOD_BLOCKS; half *= 2u) {
        for (uint32_t j = 0; j < half; j++) {
            const double angle = sign * 0.5 * TWO_PI_DOUBLE * (double)j / (double)half;
            const struct complex turn = complex_of(cos(angle), sin(angle));
            for (uint32_t k = j; k < PERIOD_BLOCKS; k += 2u * half) {
                const struct complex low = values[k];
                const struct complex high = complex_product(values[k + half], turn);
                values[k] = complex_sum(low, high);
                values[k + half] = complex_of(low.re - high.re, low.im - high.im);
                if (++steps % PIECE == 0u) {
                    identification_pause();
                }
            }
        }
    }
}

void fourier_forward(struct complex values[PERIOD_BLOCKS])
{
    transform(values, -1.0);
}

void fourier_backward(struct complex values[PERIOD_BLOCKS])
{
    transform(values, 1.0);
}

void fourier_parts(const struct complex values[PERIOD_BLOCKS], uint32_t frequency,
                   struct complex *first, struct complex *second)
{
    const struct complex here = values[frequency];
    const struct complex there = values[(PERIOD_BLOCKS - frequency) % PERIOD_BLOCKS];
    *first = complex_of(0.5 * (here.re + there.re), 0.5 * (here.im - there.im));
    *second = complex_of(0.5 * (here.im + there.im), 0.5 * (there.re - here.re));
}

void fourier_put_parts(struct complex values[PERIOD_BLOCKS], uint32_t frequency,
                       struct complex first, struct complex second)
{
    values[frequency] = complex_of(first.re - second.im, first.im + second.re);
    values[PERIOD_BLOCKS - frequency] =
        complex_of(first.re + second.im, second.re - first.im);
}
