/* Four linear equations. */
#ifndef EQUATIONS_H
#define EQUATIONS_H

#include <stdbool.h>

#include "identification_network.h"

struct equations {
    double matrix[NETWORK_PARAMETERS][NETWORK_PARAMETERS];
    double right[NETWORK_PARAMETERS]; /* side; the solution afterwards */
};

/* Gaussian elimination with the largest pivot; false where there is no single solution. */
bool equations_solve(struct equations *equations);

/* Of the right side. */
double equations_norm(const struct equations *equations);

#endif
