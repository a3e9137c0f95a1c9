// Certificates and keys of TLS in files of PEM form, checked before a library of TLS gets them: that would only say
// that something is wrong.
#pragma once

#include <string>

#include "renderer/base/result.h"

namespace helio {

// Of at most 1 MiB. What is wrong goes into `problems` as one of `where`, with the file and, where it is broken, which
// certificate of it; then the answer is empty. A key's bytes are never shown.
std::string read_certificate_file(const std::string& file, const std::string& where, Problems& problems);
// The key of the first of these certificates (empty: that is not checked), without a passphrase.
std::string read_key_file(const std::string& file, const std::string& certificates, const std::string& certificate_file,
                          const std::string& where, Problems& problems);

// Whether the first of these certificates has expired or is not valid yet: a clause, empty: it is valid now.
std::string validity_problem(const std::string& certificates);

}  // namespace helio
