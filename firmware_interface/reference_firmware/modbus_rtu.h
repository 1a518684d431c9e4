/* Modbus RTU slave: frames, their timing and CRC, function codes, exceptions. [main]
 *
 * Function codes 3 (read holding registers), 6 (write one) and 16 (write several).
 */
#ifndef MODBUS_RTU_H
#define MODBUS_RTU_H

#define MODBUS_DEVICE 1u

/* Take what the line received; answer a request when it is complete. */
void modbus_rtu_poll(void);

#endif
