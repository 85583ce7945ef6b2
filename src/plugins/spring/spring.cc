namespace gapscope::plugins {
void RegisterSpring() {}
}  // namespace gapscope::plugins
