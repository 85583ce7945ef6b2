namespace gapscope::plugins {
void RegisterFriction() {}
}  // namespace gapscope::plugins
