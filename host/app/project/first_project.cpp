#include "host/app/project/first_project.hpp"

#include <fmt/format.h>

#include "host/app/project/effort_hold.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/model/signature.hpp"

namespace flexspline::project {
namespace {

std::string name_of(const std::filesystem::path& folder) {
  const std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

}  // namespace

FirstProject first_project(Draft& draft, const Request& request) {
  if (!draft.open_question.empty()) throw RequestError(draft.open_question);
  FirstProject project;
  project.dataset = load_draft(draft, request);
  for (std::string& text : data::warning_texts(project.dataset.findings)) project.warnings.push_back(std::move(text));
  take_facts_of_values(draft, project.dataset);
  for (const std::string& doubt : implausible_sides(draft, project.dataset)) project.warnings.push_back(doubt);
  project.base = base_model(project.dataset, name_of(request.out));
  if (project.base.model.effects.empty())
    throw RequestError(
        fmt::format("no torque balance can be formed from these columns: {}; name the columns with --map",
                    output::listed(project.base.reasons, "and")));
  take_hold_of_values(project.base.model, draft, project.dataset);
  return project;
}

std::string text_of(const BaseModel& base) {
  std::string text = "# A first model: the effects that these signals can show, to be identified.\n";
  for (const std::string& reason : base.reasons) text += fmt::format("# {}\n", reason);
  return model::signed_by_tool(text + "\n" + model::write(base.model));
}

}  // namespace flexspline::project
