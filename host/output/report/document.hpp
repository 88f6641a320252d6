// All that a report page shows, gathered into one JSON document.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/engine/blackbox/specification.hpp"
#include "host/engine/comparison/compare.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::report {

// What a page is about. Models need values.
struct Subject {
  std::string command{};     // "diagnose"
  std::string data_name{};   // as the user named the data
  std::string model_name{};  // likewise
  const data::Dataset* dataset = nullptr;
  model::Model model{};                  // of the page
  std::optional<model::Model> before{};  // without what was added
  estimation::PipelineOptions pipeline{};
  std::vector<blackbox::Specification> baselines{};  // black boxes to compare with `model`
  comparison::CompareOptions extent{};               // of what is compared
  // Each only where the command has it.
  std::vector<estimation::Estimate> estimates{};  // of `model`
  std::vector<selection::Diagnosis> rounds{};     // the first of `before` where there is one
  std::optional<selection::Addition> addition{};  // or removal, of the command `remove`
};

// "flexspline-report/1"; README.md describes its content. Compares model and measurement once more, as `compare` does.
// Throws what comparison::compare throws.
nlohmann::json document(const Subject& subject);

// Throws std::runtime_error saying what to do unless a page could be written there.
void require_place(const std::filesystem::path& file);
// Writes the page of `subject`, whole or not at all. Throws as `document` and model::save do.
void write(const std::filesystem::path& file, const Subject& subject);

}  // namespace flexspline::report
