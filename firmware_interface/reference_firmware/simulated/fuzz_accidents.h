/* What happens to the board from elsewhere than its line. */
#ifndef FUZZ_ACCIDENTS_H
#define FUZZ_ACCIDENTS_H

/* Stop button, limit switches, encoder, or a push by hand. */
void fuzz_inputs(void);

/* Power off and on again, perhaps with a damaged memory, perhaps elsewhere. */
void fuzz_power(void);

/* Some samples go by. */
void fuzz_wait(void);

#endif
