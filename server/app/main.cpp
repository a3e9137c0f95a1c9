// heliographd: the render daemon.
#include "server/app/daemon.h"

int main(int argc, char** argv) {
  return helio::run_daemon("heliographd", std::vector<std::string>(argv + 1, argv + argc));
}
