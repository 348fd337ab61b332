"""What spoils the photos of a capture, by how they fit the transport that was made of them."""
