// What daemons that were killed have left beside the files that they finished. Only names that no one but a daemon
// gives are looked at; what may be of use to somebody is named, and stays until jobs of its age would be forgotten.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/jobs/output_roots.h"
#include "server/state/job_table.h"

namespace helio {

// Of the folder of kept pictures (results/JOB/VIEW.exr): removes temporary files, and the folders of jobs that the
// table does not know and that are older than `keep_days`; younger ones are told in `notices`, once for all.
void clear_results(const std::string& results, const JobTable& table, double keep_days,
                   std::vector<std::string>& notices);

// Removes the temporary files (FILE.tmp-PROCESS-NUMBER) of the pictures that these jobs were about to write, where the
// process is gone.
void clear_outputs(const OutputRoots& outputs, std::span<const JobRecord> unfinished);

}  // namespace helio
