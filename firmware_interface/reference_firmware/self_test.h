/* What can be found out at power-up without moving. */
#ifndef SELF_TEST_H
#define SELF_TEST_H

#include <stdbool.h>

/* Whether the settings of the port are such that the firmware can keep its promises with them. */
bool self_test_settings(void);

#endif
