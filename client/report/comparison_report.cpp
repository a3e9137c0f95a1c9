#include "client/report/comparison_report.h"

#include "client/report/answer_section.h"
#include "client/report/line_plot.h"
#include "client/report/measure_section.h"
#include "client/report/pacing_section.h"
#include "client/report/page_frame.h"
#include "client/report/page_parts.h"
#include "client/report/pictures/picture_section.h"
#include "client/report/repeat_section.h"
#include "client/report/report_data.h"

namespace helio {

std::string comparison_report(const heliograph::v1::CompareRecord& record, const std::filesystem::path& folder) {
  const report::ReportData data(record);
  const std::string markers = "<svg class=\"markers\" width=\"0\" height=\"0\" aria-hidden=\"true\">" +
                              report::plot_markers(data.modes()) + "</svg>\n";
  std::string body = report::answer_section(data);
  body += report::measure_section(data);
  body += report::speed_section(data);
  body += report::picture_section(data, folder);
  body += report::pacing_section(data);
  body += report::repeat_section(data);
  return report::page_frame(report::report_title(data), report::plot_style(data.modes(), true), markers, body,
                            std::string(report::page_script()));
}

}  // namespace helio
