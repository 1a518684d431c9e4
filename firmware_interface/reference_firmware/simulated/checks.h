/* What the firmware is to do, checked in simulated time and from inside where no host can look. */
#ifndef CHECKS_H
#define CHECKS_H

#include <stdint.h>

struct check {
    const char *name;
    void (*run)(void);
};

extern const struct check board_checks[], motion_checks[], transfer_checks[],
    stop_checks[], identification_checks[];
extern const unsigned board_check_count, motion_check_count, transfer_check_count,
    stop_check_count, identification_check_count;

/* Ends the program with the place of a condition that does not hold. */
#define CHECK(condition) check_holds((condition), #condition, __FILE__, __LINE__)
void check_holds(int holds, const char *condition, const char *file, int line);

/* Power up, hold the board and enable the axes. */
void check_set_up(void);

/* One sine on both axes, checked and armed. */
void check_arm_sine(float amplitude_rad, float rate_rad_s, uint32_t capture_samples);

/* Call the main loop until ARM has ended. */
void check_finish_arming(void);

#endif
