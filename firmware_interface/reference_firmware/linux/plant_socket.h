/* A plant in another process, sample by sample over a socket: docs/plant_socket.md. */
#ifndef PLANT_SOCKET_H
#define PLANT_SOCKET_H

#include <stdbool.h>

#include "../port.h"

/* Connect to the plant that listens at a path, and learn what its encoders show. False, and the
 * reason on stderr, where there is none, or where it refuses. */
bool plant_socket_open(const char *path, double delay_s, double shown_rad[FD_AXES]);

/* Let one sample pass under these efforts; gives what the encoders show at its end. False where the
 * plant is gone. */
bool plant_socket_advance(const double effort_nm[FD_AXES], double shown_rad[FD_AXES]);

#endif
