/* What must hold whatever comes over the line; a breach ends the program. */
#ifndef FUZZ_INVARIANTS_H
#define FUZZ_INVARIANTS_H

/* Watch the board from now on: after simulation_reset, before power-up. */
void invariants_watch(void);

/* What was seen, so that a run that tried nothing is found out. */
struct seen {
    unsigned long replies, exceptions, samples_with_effort, samples_in_motion, samples_in_fault;
    unsigned long starts, enables, refused_trajectories, exchanges;
};
extern struct seen invariants_seen;

#endif
