"""One contact whose normal motion is known beforehand: prescribed quasi-static paths, and whole impacts."""
