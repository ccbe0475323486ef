/* Stands in for the HIL library in tests: a card with eight inputs, outputs and encoders, and a watchdog that the test lets expire. */
#include <stdint.h>
#include <string.h>

double fake_input[8], fake_output[8], fake_expiration[8], fake_timeout;
int fake_open, fake_failing, fake_expired, fake_running;
int32_t fake_count[8];

int hil_open(const char *type, const char *id, void **card) {
  if (strcmp(type, "q8_usb") != 0 || strcmp(id, "0") != 0) {
    return -15;
  }
  *card = fake_output;
  fake_open = 1;
  return 0;
}
int hil_close(void *card) {
  fake_open = 0;
  return card == fake_output ? 0 : -1;
}
int hil_set_analog_input_ranges(void *card, const uint32_t *c, uint32_t n, const double *low, const double *high) {
  return card != NULL && c != NULL && n == 4 && low[3] == -10 && high[3] == 10 ? 0 : -1;
}
int hil_set_analog_output_ranges(void *card, const uint32_t *c, uint32_t n, const double *low, const double *high) {
  return card != NULL && c != NULL && n == 2 && low[1] == -10 && high[1] == 10 ? 0 : -1;
}
int hil_read(void *card, const uint32_t *a, uint32_t na, const uint32_t *e, uint32_t ne, const uint32_t *d, uint32_t nd,
             const uint32_t *o, uint32_t no, double *analog, int32_t *encoder, char *digital, double *other) {
  (void)card, (void)d, (void)o, (void)digital, (void)other;
  if (fake_failing || nd != 0 || no != 0) {
    return -1;
  }
  for (uint32_t i = 0; i < na; i++) {
    analog[i] = fake_input[a[i]];
  }
  for (uint32_t i = 0; i < ne; i++) {
    encoder[i] = fake_count[e[i]];
  }
  return 0;
}
int hil_write_analog(void *card, const uint32_t *c, uint32_t n, const double *volts) {
  (void)card;
  for (uint32_t i = 0; i < n && !fake_failing; i++) {
    fake_output[c[i]] = volts[i];
  }
  return fake_failing ? -1 : 0;
}
int hil_watchdog_set_analog_expiration_state(void *card, const uint32_t *c, uint32_t n, const double *volts) {
  (void)card;
  for (uint32_t i = 0; i < n; i++) {
    fake_expiration[c[i]] = volts[i];
  }
  return 0;
}
int hil_watchdog_start(void *card, double timeout) {
  (void)card;
  fake_timeout = timeout;
  fake_running = 1;
  return 0;
}
int hil_watchdog_reload(void *card) {
  (void)card;
  return fake_expired ? 0 : 1;
}
int hil_watchdog_clear(void *card) {
  (void)card;
  fake_expired = 0;
  return 0;
}
int hil_watchdog_stop(void *card) {
  (void)card;
  fake_running = 0;
  return 0;
}
