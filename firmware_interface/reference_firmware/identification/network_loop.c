#include "network_loop.h"

#include <math.h>

#include "../port.h"
#include "equations.h"
#include "pause.h"

#define PARAMETERS NETWORK_PARAMETERS
#define POINTS NETWORK_POINTS
#define MOST_IMAGES 8u
#define CONVERGED 1e-5 /* change of the shares */
#define SHRUNK 0.85 /* a remainder over that before: the answer has come closer */
#define SMALLEST 1e-4 /* share that stands for zero where physics requires a positive parameter */
#define LARGEST_RESIDUAL 0.15
#define FEWEST_MOVING 0.5
#define LARGEST_SHARE 13.815509557963774 /* of a residual: the sigmoid is within 1e-6 of its ends */
#define TINY 1e-300

/* The regressor at a point. */
static double column(const struct conditioned *seen, unsigned parameter, uint32_t point)
{
    return parameter < PARAMETERS - 1u ? seen->column[parameter][point] : seen->last_column;
}

/* The regressor over the scales of the network's motion. */
static void scale_columns(struct conditioned *seen)
{
    for (unsigned parameter = 0; parameter < PARAMETERS - 1u; parameter++) {
        identification_pause();
        for (uint32_t n = 0; n < POINTS; n++) {
            seen->column[parameter][n] /= network_scales[parameter];
        }
    }
    seen->last_column /= network_scales[PARAMETERS - 1u];
}

static double modelled(const struct conditioned *seen, const double shares[PARAMETERS],
                       uint32_t point)
{
    double sum = 0.0;
    for (unsigned parameter = 0; parameter < PARAMETERS; parameter++) {
        sum += column(seen, parameter, point) * shares[parameter];
    }
    return sum;
}

/* Root of two times the mean square. */
static double scale_of(const double efforts[POINTS])
{
    double sum = 0.0;
    for (uint32_t n = 0; n < POINTS; n++) {
        sum += efforts[n] * efforts[n];
    }
    return sqrt(2.0 * sum / POINTS);
}

/* How far the motion is from the network's: the largest difference of a column. */
static double mismatch(const struct conditioned *seen)
{
    double largest = 0.0;
    for (unsigned parameter = 0; parameter < PARAMETERS; parameter++) {
        double sum = 0.0;
        identification_pause();
        for (uint32_t n = 0; n < POINTS; n++) {
            const double difference =
                column(seen, parameter, n) - network_regressor[parameter][n];
            sum += difference * difference;
        }
        largest = fmax(largest, sqrt(sum) / network_norms[parameter]);
    }
    return largest;
}

/* From shares of the network's motion to those of this one. */
static struct equations mapping(const struct conditioned *seen)
{
    struct equations mapped;
    for (unsigned row = 0; row < PARAMETERS; row++) {
        identification_pause();
        for (unsigned other = 0; other < PARAMETERS; other++) {
            double sum = 0.0;
            for (uint32_t n = 0; n < POINTS; n++) {
                sum += network_inverse[row][n] * column(seen, other, n);
            }
            mapped.matrix[row][other] = sum;
        }
    }
    return mapped;
}

static void show(const double remainder[POINTS], float *image)
{
    for (uint32_t row = 0; row < POINTS; row++) {
        identification_pause();
        for (uint32_t n = 0; n < POINTS; n++) {
            image[row * POINTS + n] = (float)(network_start_effort[row] * remainder[n]);
        }
    }
}

/* One pass: by how much the shares are to be lowered, and the scale of what they leave of the
 * effort; false where the network has no answer. */
static bool pass(const struct conditioned *seen, const double measured[POINTS],
                 const double shares[PARAMETERS], struct equations *equations, double *left,
                 struct loop_memory *memory)
{
    double remainder[POINTS];
    float residuals[PARAMETERS], sigmoids[PARAMETERS];
    identification_pause();
    for (uint32_t n = 0; n < POINTS; n++) {
        remainder[n] = measured[n] - modelled(seen, shares, n);
    }
    const double scale = fmax(scale_of(remainder), TINY);
    *left = scale;
    for (uint32_t n = 0; n < POINTS; n++) {
        remainder[n] /= scale;
    }
    show(remainder, memory->image);
    if (!NETWORK_RUN(memory->image, &memory->network, residuals, sigmoids)) {
        return false;
    }
    for (unsigned n = 0; n < PARAMETERS; n++) {
        equations->right[n] = scale * fmax(-LARGEST_SHARE, fmin(LARGEST_SHARE, (double)residuals[n]));
    }
    return equations_solve(equations);
}

static void score(const struct conditioned *seen, const double measured[POINTS], double scale,
                  double shares[PARAMETERS], struct network_answer *answer)
{
    double left = 0.0, whole = 0.0;
    for (unsigned n = 0; n < PARAMETERS; n++) {
        shares[n] = n < PARAMETERS - 1u ? fmax(shares[n], SMALLEST) : shares[n];
    }
    for (uint32_t n = 0; n < POINTS; n++) {
        const double difference = measured[n] - modelled(seen, shares, n);
        left += difference * difference;
        whole += measured[n] * measured[n];
    }
    const double residual = sqrt(left / whole);
    if (!(residual <= LARGEST_RESIDUAL)) {
        answer->reason = FD_IDENTIFICATIONREASON_UNEXPLAINED;
        return;
    }
    answer->relative_residual = (float)residual;
    for (unsigned n = 0; n < PARAMETERS; n++) {
        answer->parameters[n] = (float)(shares[n] * scale / network_scales[n]);
    }
}

static enum fd_identificationreason illegible(const struct conditioned *seen)
{
    if (!(seen->moving_share >= FEWEST_MOVING)) {
        return FD_IDENTIFICATIONREASON_STANDSTILL;
    }
    if (!(mismatch(seen) <= NETWORK_MISMATCH_LIMIT)) {
        return FD_IDENTIFICATIONREASON_OTHER_MOTION;
    }
    return scale_of(seen->effort) > (double)port_settings()->effort_per_count_nm
        ? FD_IDENTIFICATIONREASON_NONE : FD_IDENTIFICATIONREASON_NO_EFFORT;
}

struct network_answer read_parameters(struct conditioned *seen, struct loop_memory *memory,
                                      bool (*goes_on)(void))
{
    struct network_answer answer = {.reason = illegible(seen)};
    if (answer.reason != FD_IDENTIFICATIONREASON_NONE) {
        return answer;
    }
    scale_columns(seen);
    const double scale = scale_of(seen->effort);
    const struct equations mapped = mapping(seen);
    double measured[POINTS], shares[PARAMETERS], change = HUGE_VAL, before = HUGE_VAL;
    for (uint32_t n = 0; n < POINTS; n++) {
        measured[n] = seen->effort[n] / scale;
    }
    for (unsigned n = 0; n < PARAMETERS; n++) {
        shares[n] = network_start[n];
    }
    while (answer.images < MOST_IMAGES && change > CONVERGED && goes_on()) {
        struct equations equations = mapped;
        double left;
        answer.images++;
        if (!pass(seen, measured, shares, &equations, &left, memory)) {
            answer.reason = FD_IDENTIFICATIONREASON_UNEXPLAINED;
            return answer;
        }
        const double step = equations_norm(&equations);
        if (step > change && left > SHRUNK * before) { /* about what the network can resolve */
            break;
        }
        for (unsigned n = 0; n < PARAMETERS; n++) {
            shares[n] -= equations.right[n];
        }
        change = step;
        before = left;
    }
    score(seen, measured, scale, shares, &answer);
    return answer;
}
