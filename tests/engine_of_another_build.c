// The entries of an engine module, as another build would have them.
#include <stddef.h>

__attribute__((visibility("default"))) const char* tessera_engine_interface(void) { return "another build"; }
__attribute__((visibility("default"))) void* tessera_make_engine(const void* settings) {
  (void)settings;
  return NULL;
}
