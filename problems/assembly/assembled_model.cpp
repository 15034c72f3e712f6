#include "problems/assembly/assembled_model.h"

#include <fmt/format.h>

#include <utility>

namespace ricochet {

AssembledModel::AssembledModel(const SceneText& text, const GiNaC::ex& end_time) {
  model_.id = text.id;
  model_.title = text.title;
  model_.source = text.source;
  model_.hard_feature = text.hard_feature;
  model_.end_time = end_time;
}

int AssembledModel::add_coordinate(const GiNaC::ex& m, const GiNaC::ex& f, const GiNaC::ex& q0, const GiNaC::ex& v0) {
  const std::size_t k = model_.q.size();
  model_.q.emplace_back(fmt::format("q[{}]", k));
  model_.v.emplace_back(fmt::format("v[{}]", k));
  model_.q0.push_back(q0);
  model_.v0.push_back(v0);
  model_.force.push_back(f);
  masses_.push_back(m);
  return static_cast<int>(k);
}

int AssembledModel::add_contact(const Kind& kind, const std::vector<int>& coordinates, std::string name) {
  SymbolicModel::Expressions q;
  for (const int k : coordinates) q.push_back(model_.q[static_cast<std::size_t>(k)]);
  model_.contacts.push_back(kind.contact_at_(q));
  model_.contacts.back().name = std::move(name);
  coordinates_.push_back(coordinates);
  return static_cast<int>(model_.contacts.size()) - 1;
}

SymbolicModel AssembledModel::finish() {
  const std::size_t n = model_.q.size();
  model_.mass.assign(n, SymbolicModel::Expressions(n, 0));
  GiNaC::ex potential = 0;
  for (std::size_t k = 0; k < n; ++k) {  // (1)
    model_.mass[k][k] = masses_[k];
    potential -= model_.force[k] * model_.q[k];
  }
  model_.potential_energy = potential;
  for (std::size_t i = 0; i < model_.contacts.size(); ++i) {
    for (auto& direction : model_.contacts[i].tangents) {
      SymbolicModel::Expressions all(n, 0);
      for (std::size_t k = 0; k < direction.size(); ++k)
        all[static_cast<std::size_t>(coordinates_[i][k])] = direction[k];
      direction = std::move(all);
    }
  }
  return std::move(model_);
}

}  // namespace ricochet
