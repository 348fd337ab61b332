"""What a measured transport is for: linear algebra on T that answers a question about the scene."""
