/* The discrete Fourier transform of a period, in place. */
#ifndef FOURIER_H
#define FOURIER_H

#include "period.h"

struct complex {
    double re;
    double im;
};

struct complex complex_of(double re, double im);
struct complex complex_sum(struct complex a, struct complex b);
struct complex complex_product(struct complex a, struct complex b);
struct complex complex_conjugate(struct complex a);

/* Sum of x[n] e^(-2 pi i k n / N), and of X[k] e^(2 pi i k n / N) without the factor 1 / N. */
void fourier_forward(struct complex values[PERIOD_BLOCKS]);
void fourier_backward(struct complex values[PERIOD_BLOCKS]);

/* Of the transform of a signal a + i b: that of a and that of b, at a frequency. */
void fourier_parts(const struct complex values[PERIOD_BLOCKS], uint32_t frequency,
                   struct complex *first, struct complex *second);

/* The reverse, for frequencies above zero and below the last: both real signals in one transform. */
void fourier_put_parts(struct complex values[PERIOD_BLOCKS], uint32_t frequency,
                       struct complex first, struct complex second);

#endif
