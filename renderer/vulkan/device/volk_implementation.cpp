// The one place that volk's functions are compiled in.
#define VOLK_IMPLEMENTATION
#include <volk.h>
