// How a connection to a daemon is encrypted, and who proves to be whom. Files are PEM.
#pragma once

#include <string>

namespace helio {

struct TlsOptions {
  bool on = false;               // false: everything travels unencrypted, and the rest counts for nothing
  std::string ca_file;           // authorities that the daemon's certificate may come from; empty: those of the system
  std::string certificate_file;  // of this client, where the daemon asks for one; goes with key_file
  std::string key_file;          // without a passphrase
  std::string name;              // that the daemon's certificate has; empty: the address's host
};

}  // namespace helio
