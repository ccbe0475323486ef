/* Stands in for comedilib in tests: 16 bits of +-10 V and a counter of 24 bits. */
#include <math.h>
#include <string.h>

typedef struct {
  double min, max;
  unsigned unit;
} comedi_range;

unsigned fake_input[8], fake_output[8], fake_count[8];
int fake_open, fake_failing;
static comedi_range range = {-10, 10, 0};

void *comedi_open(const char *file) {
  fake_open = strcmp(file, "/dev/comedi0") == 0;
  return fake_open ? &range : NULL;
}
int comedi_close(void *device) {
  fake_open = 0;
  return device == &range ? 0 : -1;
}
int comedi_find_subdevice_by_type(void *device, int type, unsigned start) {
  (void)device, (void)start;
  return type == 1 ? 0 : type == 2 ? 1 : type == 6 ? 4 : -1;
}
unsigned comedi_get_maxdata(void *device, unsigned subdevice, unsigned channel) {
  (void)device;
  return channel > 7 ? 0 : subdevice == 4 ? 0xffffffU : 0xffffU;
}
comedi_range *comedi_get_range(void *device, unsigned subdevice, unsigned channel, unsigned index) {
  (void)device, (void)subdevice;
  return channel > 7 || index != 0 ? NULL : &range;
}
int comedi_data_read(void *device, unsigned subdevice, unsigned channel, unsigned r, unsigned aref, unsigned *data) {
  (void)device, (void)r, (void)aref;
  *data = subdevice == 4 ? fake_count[channel] : fake_input[channel];
  return fake_failing ? -1 : 1;
}
int comedi_data_write(void *device, unsigned subdevice, unsigned channel, unsigned r, unsigned aref, unsigned data) {
  (void)device, (void)r, (void)aref;
  if (subdevice != 1 || fake_failing) {
    return -1;
  }
  fake_output[channel] = data;
  return 1;
}
double comedi_to_phys(unsigned data, comedi_range *r, unsigned most) { return r->min + (r->max - r->min) * data / most; }
unsigned comedi_from_phys(double volts, comedi_range *r, unsigned most) {
  return (unsigned)floor((volts - r->min) / (r->max - r->min) * most + 0.5);
}
