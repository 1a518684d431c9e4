/* What the fuzzer does to the board: bytes, frames, commands, motions, accidents. */
#ifndef FUZZ_PLAYS_H
#define FUZZ_PLAYS_H

/* One after the other, as long as there are bytes to choose from, or for half a minute. */
void fuzz_plays(void);

#endif
