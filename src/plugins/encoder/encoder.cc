namespace gapscope::plugins {
void RegisterEncoder() {}
}  // namespace gapscope::plugins
