/* Start of the processor and output by semihosting; no library of the board's maker is needed. */
#include "start.h"

extern uint32_t data_start[], data_end[], data_load[], bss_start[], bss_end[], stack_top[];
int main(void);

static void halt(void) { finish(3); }

void reset(void) {
  volatile uint32_t *const coprocessors = (volatile uint32_t *)0xE000ED88u;
  uint32_t i;
  *coprocessors |= 0xFu << 20; /* the floating-point unit */
  __asm__ volatile("dsb\n isb");
  for (i = 0; data_start + i < data_end; ++i) data_start[i] = data_load[i];
  for (i = 0; bss_start + i < bss_end; ++i) bss_start[i] = 0;
  finish((uint32_t)main());
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, (const void *)reset, (const void *)halt, (const void *)halt, (const void *)halt, (const void *)halt,
    (const void *)halt, 0, 0, 0, 0, (const void *)halt, (const void *)halt, 0, (const void *)halt, (const void *)halt};

static uint32_t host(uint32_t what, const void *argument) {
  register uint32_t r0 __asm__("r0") = what;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void print_text(const char *text) { (void)host(4, text); }

void print_number(uint32_t value) {
  char digits[12];
  int at = 11;
  digits[at] = '\0';
  do {
    digits[--at] = (char)('0' + value % 10u);
    value /= 10u;
  } while (value != 0u);
  print_text(digits + at);
}

void finish(uint32_t code) {
  const uint32_t exit_block[2] = {0x20026u, code};
  (void)host(0x20, exit_block);
  for (;;) {
  }
}
