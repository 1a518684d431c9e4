/* The loop in which the network reads the parameters from what the guess before leaves of the
 * effort. edge_ident/estimation/network_estimate.py does the same. */
#ifndef NETWORK_LOOP_H
#define NETWORK_LOOP_H

#include "conditioning.h"

struct network_answer {
    enum fd_identificationreason reason;
    uint16_t images;
    float parameters[NETWORK_PARAMETERS];
    float relative_residual;
};

struct loop_memory {
    float image[NETWORK_POINTS * NETWORK_POINTS];
    network_memory network;
};

/* Scales what it has seen. Ends early where goes_on says that nobody wants the answer any more. */
struct network_answer read_parameters(struct conditioned *seen, struct loop_memory *memory,
                                      bool (*goes_on)(void));

#endif
