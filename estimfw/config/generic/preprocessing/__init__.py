"""The framework's own preprocessing: settings, and the components that they make."""
