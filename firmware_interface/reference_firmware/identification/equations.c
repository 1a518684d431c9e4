#include "equations.h"

#include <math.h>

#define SIZE NETWORK_PARAMETERS

static void exchange(struct equations *equations, unsigned row, unsigned other)
{
    for (unsigned n = 0; n < SIZE; n++) {
        const double kept = equations->matrix[row][n];
        equations->matrix[row][n] = equations->matrix[other][n];
        equations->matrix[other][n] = kept;
    }
    const double kept = equations->right[row];
    equations->right[row] = equations->right[other];
    equations->right[other] = kept;
}

/* Zeros below the diagonal. */
static bool eliminate(struct equations *equations)
{
    for (unsigned pivot = 0; pivot < SIZE; pivot++) {
        unsigned best = pivot;
        for (unsigned row = pivot + 1u; row < SIZE; row++) {
            const double size = fabs(equations->matrix[row][pivot]);
            best = size > fabs(equations->matrix[best][pivot]) ? row : best;
        }
        if (!(fabs(equations->matrix[best][pivot]) > 0.0)) {
            return false;
        }
        exchange(equations, pivot, best);
        for (unsigned row = pivot + 1u; row < SIZE; row++) {
            const double factor =
                equations->matrix[row][pivot] / equations->matrix[pivot][pivot];
            for (unsigned n = pivot; n < SIZE; n++) {
                equations->matrix[row][n] -= factor * equations->matrix[pivot][n];
            }
            equations->right[row] -= factor * equations->right[pivot];
        }
    }
    return true;
}

bool equations_solve(struct equations *equations)
{
    if (!eliminate(equations)) {
        return false;
    }
    for (unsigned row = SIZE; row-- > 0;) {
        for (unsigned n = row + 1u; n < SIZE; n++) {
            equations->right[row] -= equations->matrix[row][n] * equations->right[n];
        }
        equations->right[row] /= equations->matrix[row][row];
    }
    return true;
}

double equations_norm(const struct equations *equations)
{
    double sum = 0.0;
    for (unsigned n = 0; n < SIZE; n++) {
        sum += equations->right[n] * equations->right[n];
    }
    return sqrt(sum);
}
